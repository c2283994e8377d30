#include "host_tools/experiment/max_stiffness_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/paper_numbers.hpp"

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

}  // namespace

std::string clip_words(const simulation::DeviceModel& device) {
  return device.force_limit > 0.0 ? fmt::format("force clipped at {:g} N", device.force_limit)
                                  : "force not clipped";
}

report::Table max_stiffness_table(const std::vector<MaxStiffnessStudy>& studies) {
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
      row.push_back(fmt::format("{} ({})", n_per_mm(result.mean()), n_per_mm(result.standard_deviation())));
      row.push_back(fmt::format("{:.1f} %", result.largest_saturated_share() * 100));
    }
    row.emplace_back(report::words_of(condition.origin));
    table.rows.push_back(std::move(row));
  }
  return table;
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
    if (!result.condition.paper) continue;
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
      "a hold. \"Calibrated\" means that friction and activation were fitted to this very number; everything "
      "else is predicted, without another fit.",
      first.set.subjects.size(), first.protocol.touches(), first.steps.step, first.protocol.threshold * 1e3));
  for (const MaxStiffnessStudy& study : studies) {
    section.paragraphs.push_back(
        fmt::format("{}: gamma = {:.4g} /N, friction {:.4g} N; {} touches, {:.0f} s simulated.",
                    clip_words(study.set.device), study.set.subjects.front().person.activation_gain,
                    study.set.device.friction, study.touches, study.simulated_time));
  }
  section.tables.push_back(max_stiffness_table(studies));
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
                    std::abs(most - printed) <= magnetic_tolerance ? "agrees" : "does not reach it",
                    most < two->mean() ? "below" : "not below", n_per_mm(two->mean())));
  }
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
      "people press, and other choices that meet 3.58 N/mm are in the table of assumptions. gamma is "
      "identifiable only together with the force limit: with the force clipped, part of the gain is the "
      "clip's.");
  return section;
}

report::Section cause_section(const std::vector<ClippedCauses>& results) {
  report::Section section{"The causes, one by one", {}, {}, {}};
  section.paragraphs.push_back(
      "Adding a field of F_MC = 2 N changes four things: the hand stiffens, the field reaches out in front "
      "of the "
      "wall, its force is a preload, and a force limit is met sooner. Each row leaves only some of them; the "
      "columns are the force limit. 0 means that even the first stiffness of the search was unstable.");
  report::Table table{
      "Largest stable stiffness, N/mm, mean of the people", {"what is there", "which is"}, {}};
  for (const ClippedCauses& result : results) table.columns.push_back(clip_words(result.set.device));
  for (std::size_t n = 0; n < results.front().causes.size(); ++n) {
    std::vector<std::string> row{results.front().causes[n].condition.name,
                                 results.front().causes[n].condition.what};
    // How much stiffer the hand is differs from one calibration to the other.
    if (row[1].find("times") != std::string::npos)
      row[1] = row[1].substr(0, row[1].find(" times")) + " grown";
    for (const ClippedCauses& result : results) row.push_back(n_per_mm(result.causes[n].mean));
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
    for (const ClippedCauses& result : results) row.push_back(n_per_mm(result.lengths[n].mean));
    lengths.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(lengths));
  return section;
}

report::Section variation_section(const std::string& heading, const std::vector<VariationResult>& results) {
  report::Section section{heading, {}, {}, {}};
  report::Table table{"Largest stable stiffness, N/mm, mean of the people",
                      {"varied", "to", "fitted again", "friction, N", "gamma, 1/N"},
                      {}};
  for (const StiffnessCondition& condition : stiffness_conditions()) table.columns.push_back(condition.name);
  for (const VariationResult& result : results) {
    std::vector<std::string> row{
        result.variation.group, result.variation.name, result.variation.refit ? "yes" : "no",
        fmt::format("{:.4g}", result.friction), fmt::format("{:.4g}", result.activation_gain)};
    for (const double mean : result.means) row.push_back(n_per_mm(mean));
    table.rows.push_back(std::move(row));
  }
  section.tables.push_back(std::move(table));
  for (const VariationFinding& finding : findings_of(results)) {
    const std::string_view word = finding.holds == finding.of           ? "Robust"
                                  : finding.holds == 0                  ? "Never"
                                  : 4 * finding.holds >= 3 * finding.of ? "Mostly"
                                                                        : "Not robust";
    section.paragraphs.push_back(
        fmt::format("{}: {} ({} of {}).", word, finding.claim, finding.holds, finding.of));
  }
  return section;
}

}  // namespace kmax::experiment
