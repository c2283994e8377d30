#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/max_stiffness/marked_means.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/report_words.hpp"

namespace kmax::experiment {
namespace {

std::string n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}

std::string either(const MaxStiffness& result) {
  if (result.never_touched) return "no touch";
  return fmt::format("{}{:.1f}", result.beyond_last ? ">" : "", result.stiffness / 1e3);
}

const ConditionResult* constant_of(const MaxStiffnessStudy& study, double coefficient) {
  for (const ConditionResult& result : study.conditions) {
    if (!result.condition.adaptive && result.condition.magnetic_coefficient == coefficient) return &result;
  }
  return nullptr;
}

/// Where one condition's numbers come from, in each study.
std::string origin_words(const std::vector<MaxStiffnessStudy>& studies, std::size_t condition) {
  std::vector<std::string_view> words;
  for (const MaxStiffnessStudy& study : studies) {
    const std::string_view word = report::to_string(study.conditions[condition].condition.origin);
    if (std::find(words.begin(), words.end(), word) == words.end()) words.push_back(word);
  }
  return fmt::format("{}", fmt::join(words, " / "));
}

bool any_calibrated(const std::vector<MaxStiffnessStudy>& studies) {
  return std::any_of(studies.begin(), studies.end(), [](const MaxStiffnessStudy& study) {
    return std::any_of(study.conditions.begin(), study.conditions.end(), [](const ConditionResult& result) {
      return result.condition.origin == report::Origin::calibrated;
    });
  });
}

/// The table, and in `marks` the notes to it.
report::Table marked_table(const std::vector<MaxStiffnessStudy>& studies, MarkedMeans& marks) {
  report::Table table{"Largest stable stiffness, N/mm, mean of the people (standard deviation)",
                      {"condition", "paper 1"},
                      {}};
  for (const MaxStiffnessStudy& study : studies) {
    table.columns.push_back(clip_words(study.set.device));
    table.columns.push_back("saturated");
  }
  table.columns.push_back("ours is");
  const auto& conditions = studies.front().conditions;
  for (std::size_t n = 0; n < conditions.size(); ++n) {
    const StiffnessCondition& condition = conditions[n].condition;
    std::vector<std::string> row{condition.name,
                                 condition.paper ? n_per_mm(*condition.paper) : std::string("picture only")};
    for (const MaxStiffnessStudy& study : studies) {
      const ConditionResult& result = study.conditions[n];
      const std::string mean =
          marks.cell(result.mean(), counted_ends(result.subjects), result.subjects.size(),
                     fmt::format("{}, {}", condition.name, clip_words(study.set.device)));
      row.push_back(fmt::format("{} ({})", mean, n_per_mm(result.standard_deviation())));
      row.push_back(fmt::format("{:.1f} %", result.largest_saturated_share() * 100));
    }
    row.push_back(origin_words(studies, n));
    table.rows.push_back(std::move(row));
  }
  return table;
}

void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

std::string clip_words(const simulation::DeviceModel& device) {
  return "force " + clipping_words(device);
}

report::Table max_stiffness_table(const std::vector<MaxStiffnessStudy>& studies) {
  MarkedMeans unused;
  return marked_table(studies, unused);
}

report::Table subject_table(const MaxStiffnessStudy& study) {
  report::Table table{fmt::format("By person, N/mm, {}", clip_words(study.set.device)), {"person"}, {}};
  for (const ConditionResult& result : study.conditions) table.columns.push_back(result.condition.name);
  for (std::size_t person = 0; person < study.set.subjects.size(); ++person) {
    std::vector<std::string> row{study.set.subjects[person].name};
    for (const ConditionResult& result : study.conditions) row.push_back(either(result.subjects[person]));
    table.rows.push_back(std::move(row));
  }
  return table;
}

bool as_calibrated(const MaxStiffnessStudy& study) {
  double previous = 0.0;
  for (const ConditionResult& result : study.conditions) {
    if (result.condition.adaptive) continue;
    if (result.mean() <= previous) return false;
    previous = result.mean();
    if (result.condition.origin != report::Origin::calibrated) continue;
    const double tolerance =
        result.condition.magnetic_coefficient == 0.0 ? plain_tolerance : magnetic_tolerance;
    if (std::abs(result.mean() - *result.condition.paper) > tolerance) return false;
  }
  return true;
}

report::Section max_stiffness_section(const std::vector<MaxStiffnessStudy>& studies) {
  report::Section section{"Largest stable stiffness (paper 1, Figs. 6 and 8)", {}, {}, {}};
  const MaxStiffnessStudy& first = studies.front();
  section.paragraphs.push_back(fmt::format(
      "{} simulated people, {} touches at every stiffness (approach speeds and pushes), in steps of {:g} "
      "N/m. A "
      "wall counts as unstable when the handle moves by more than {:g} mm in every quarter of the last "
      "second of "
      "a hold. {}",
      first.set.subjects.size(), first.protocol.touches(), first.steps.step, first.protocol.threshold * 1e3,
      any_calibrated(studies)
          ? "\"Calibrated\" means that friction and activation were fitted to this very number; everything "
            "else is predicted, without another fit."
          : "Everything is predicted: friction and activation are as the set has them, and were not fitted "
            "for these people and this force limit."));
  for (const MaxStiffnessStudy& study : studies) {
    section.paragraphs.push_back(
        fmt::format("{}: gamma = {:.4g} /N, friction {:.4g} N; {} touches, {:.0f} s simulated.",
                    clip_words(study.set.device), study.set.subjects.front().person.activation_gain,
                    study.set.device.friction, study.touches, study.simulated_time));
  }
  MarkedMeans marks;
  section.tables.push_back(marked_table(studies, marks));
  for (const MaxStiffnessStudy& study : studies) section.tables.push_back(subject_table(study));
  for (const MaxStiffnessStudy& study : studies) {
    const ConditionResult* two = constant_of(study, 2.0);
    double most = 0.0;
    for (const ConditionResult& result : study.conditions) {
      if (result.condition.adaptive) most = std::max(most, result.mean());
    }
    if (two == nullptr || most == 0.0) continue;
    const double printed = paper::max_stiffness.back().stiffness;
    section.paragraphs.push_back(
        fmt::format("{}: the adaptive wall reaches {} N/mm in its best mode; the paper's is {}, ours {}. It "
                    "is {} a constant 2 "
                    "N ({}).",
                    clip_words(study.set.device), n_per_mm(most), n_per_mm(printed),
                    std::abs(most - printed) <= magnetic_tolerance ? "agrees"
                    : most < printed                               ? "does not reach it"
                                                                   : "goes beyond it",
                    most < two->mean() ? "below" : "not below", n_per_mm(two->mean())));
  }
  append(section.paragraphs, marks.notes());
  return section;
}

report::Section calibration_section(const std::vector<OperatorCalibration>& calibrations) {
  report::Section section{"Calibration", {}, {}, {}};
  report::Table table{
      "Fitted to paper 1's plain 3.58 and F_MC = 2 N 8.41 N/mm",
      {"device", "friction, N", "gamma, 1/N", "plain, N/mm", "2 N, N/mm", "means computed", "met"},
      {}};
  for (const OperatorCalibration& fit : calibrations) {
    table.rows.push_back({clip_words(fit.set.device), fmt::format("{:.4g}", fit.friction),
                          fmt::format("{:.4g}", fit.activation_gain), n_per_mm(fit.plain),
                          n_per_mm(fit.magnetic), fmt::format("{}", fit.steps.size()),
                          fit.plain_met && fit.magnetic_met ? "yes" : "no"});
  }
  section.tables.push_back(std::move(table));
  section.paragraphs.push_back(
      "Two numbers can identify two. The friction of this table stands for everything that damps a plain "
      "wall: "
      "mass, viscous damping, friction and delay of the device trade against each other and against how hard "
      "people press, and --study assumptions lists other choices that meet 3.58 N/mm. gamma is "
      "identifiable only together with the force limit: with the force clipped, part of the gain is the "
      "clip's.");
  return section;
}

report::Section cause_section(const std::vector<ClippedCauses>& results) {
  report::Section section{"The causes, one by one", {}, {}, {}};
  section.paragraphs.push_back(fmt::format(
      "Adding a field of F_MC = 2 N changes four things: the hand stiffens, the field reaches out in front "
      "of the "
      "wall, its force is a preload, and a force limit is met sooner. Each row leaves only some of them; the "
      "columns are the force limit. The search begins at {:g} N/m.",
      cause_first_stiffness));
  MarkedMeans marks;
  report::Table table{
      "Largest stable stiffness, N/mm, mean of the people", {"what is there", "which is"}, {}};
  for (const ClippedCauses& result : results) table.columns.push_back(clip_words(result.set.device));
  for (std::size_t n = 0; n < results.front().causes.size(); ++n) {
    std::vector<std::string> row{results.front().causes[n].condition.name,
                                 results.front().causes[n].condition.what};
    // How much stiffer the hand is differs from one calibration to the other.
    if (row[1].find("times") != std::string::npos)
      row[1] = row[1].substr(0, row[1].find(" times")) + " grown";
    for (const ClippedCauses& result : results)
      row.push_back(marks.cell(result.causes[n].mean, result.causes[n].ends, result.set.subjects.size(),
                               fmt::format("{}, {}", row[0], clip_words(result.set.device))));
    table.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(table));
  report::Table lengths{
      "The field alone (hand unchanged) by its length", {"x_0, mm", "slope 2 F_MC/x_0, N/mm"}, {}};
  for (const ClippedCauses& result : results)
    lengths.columns.push_back(clip_words(result.set.device) + ", N/mm");
  for (std::size_t n = 0; n < results.front().lengths.size(); ++n) {
    const FieldLengthResult& length = results.front().lengths[n];
    std::vector<std::string> row{fmt::format("{:g}", length.magnetic_length * 1e3), n_per_mm(length.slope)};
    for (const ClippedCauses& result : results)
      row.push_back(marks.cell(result.lengths[n].mean, result.lengths[n].ends, result.set.subjects.size(),
                               fmt::format("x_0 = {} mm, {}", row[0], clip_words(result.set.device))));
    lengths.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(lengths));
  append(section.paragraphs, marks.notes());
  return section;
}

namespace {
/// Did the fit to the two targets reach them?
std::string fit_words(const VariationResult& result) {
  if (!result.variation.refit) return "-";
  if (result.met()) return "met";
  return fmt::format("missed: {}", !result.plain_met && !result.magnetic_met ? "both"
                                   : result.plain_met                        ? "2 N"
                                                                             : "plain");
}
}  // namespace

report::Section variation_section(const std::string& heading, const std::vector<VariationResult>& results) {
  report::Section section{heading, {}, {}, {}};
  MarkedMeans marks;
  report::Table table{"Largest stable stiffness, N/mm, mean of the people",
                      {"varied", "to", "fitted again", "targets", "friction, N", "gamma, 1/N"},
                      {}};
  for (const StiffnessCondition& condition : stiffness_conditions()) table.columns.push_back(condition.name);
  for (const VariationResult& result : results) {
    std::vector<std::string> row{result.variation.group,
                                 result.variation.name,
                                 result.variation.refit ? "yes" : "no",
                                 fit_words(result),
                                 fmt::format("{:.4g}", result.friction),
                                 fmt::format("{:.4g}", result.activation_gain)};
    for (std::size_t n = 0; n < result.means.size(); ++n) {
      row.push_back(
          marks.cell(result.means[n], n < result.ends.size() ? result.ends[n] : CountedEnds{},
                     result.variation.set.subjects.size(),
                     fmt::format("{}{}, {}", result.variation.name,
                                 result.variation.refit ? ", fitted again" : "", table.columns[row.size()])));
    }
    table.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(table));
  for (const VariationFinding& finding : findings_of(results)) {
    // Shares are of all: what a fit missed was not shown to hold.
    const std::size_t all = finding.of + finding.missed;
    const std::string_view word = finding.of == 0                ? "Not judged"
                                  : finding.holds == all         ? "Robust"
                                  : finding.holds == 0           ? "Never"
                                  : 4 * finding.holds >= 3 * all ? "Mostly"
                                                                 : "Not robust";
    section.paragraphs.push_back(fmt::format(
        "{}: {} ({} of {}{}).", word, finding.claim, finding.holds, finding.of,
        finding.missed == 0 ? ""
                            : fmt::format("; {} whose fit missed its targets left out", finding.missed)));
  }
  append(section.paragraphs, marks.notes());
  return section;
}

}  // namespace kmax::experiment
