#include "host_tools/experiment/max_stiffness/max_stiffness_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/plot/figure.hpp"

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
    if (!result.condition.adaptive() && result.condition.magnetic_coefficient == coefficient) return &result;
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
  report::Table table{
      "Largest stable stiffness, N/mm, mean of the people with its 95 % interval (standard deviation)",
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
      row.push_back(fmt::format("{} ± {} ({})", mean, n_per_mm(result.interval()),
                                n_per_mm(result.standard_deviation())));
      row.push_back(fmt::format("{:.1f} %", result.largest_saturated_share() * 100));
    }
    row.push_back(origin_words(studies, n));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string start_words(const MaxStiffnessStudy& study) {
  const StiffnessSteps& steps = study.steps;
  const double adaptive = steps.first_adaptive.value_or(steps.first);
  std::string words = fmt::format("The search begins at {:g} N/mm", steps.first / 1e3);
  if (adaptive != steps.first) words += fmt::format(" ({:g} N/mm for the adaptive wall)", adaptive / 1e3);
  if (steps.goes_down) words += " and goes down where that is unstable, of which the paper says nothing";
  if (steps.first == paper::search_start && adaptive == paper::search_start_adaptive)
    return words + ". It is the paper's start.";
  words += fmt::format("; the paper's at {:g}, and at {:g} for the adaptive wall", paper::search_start / 1e3,
                       paper::search_start_adaptive / 1e3);
  const ConditionResult* plain = constant_of(study, 0.0);
  if (plain == nullptr) return words + ".";
  const auto below = std::count_if(
      plain->subjects.begin(), plain->subjects.end(),
      [](const MaxStiffness& one) { return !one.never_touched && one.stiffness < paper::search_start; });
  return words + fmt::format(". Of {} people {} have no stable plain wall there ({}).",
                             plain->subjects.size(), below, clip_words(study.set.device));
}

std::string speed_words(const MaxStiffnessStudy& study) {
  std::vector<std::string> intended, at_contact;
  for (const ContactSpeed& speed : study.contact_speeds) {
    intended.push_back(fmt::format("{:g}", speed.intended));
    at_contact.push_back(fmt::format("{:.2g}", speed.at_contact));
  }
  return fmt::format(
      "Approach speeds are those that the hand intends. After a run-up of {:g} mm the handle meets the wall "
      "at {} m/s where {} m/s were intended (plain wall, mean of people and pushes).",
      study.run_up * 1e3, fmt::join(at_contact, ", "), fmt::join(intended, ", "));
}

/// What of the numbers can be right by itself.
constexpr auto worth_words =
    "Two numbers of the model were fitted to two of the paper's three means, so those two test nothing, and "
    "that a constant 2 N allows more than no field is implied by the fit. The paper prints no other mean of "
    "a constant field. The only mean that tests the model is the adaptive wall's.";

void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

std::string MarkedMeans::cell(double mean, const CountedEnds& ends, std::size_t people,
                              const std::string& what) {
  const auto add = [&](std::string& list, std::size_t count) {
    if (count > 0) list += fmt::format("{}{}: {} of {}", list.empty() ? "" : "; ", what, count, people);
  };
  add(at_zero_, ends.at_zero);
  add(beyond_last_, ends.beyond_last);
  return fmt::format("{}{}{:.2f}", ends.at_zero > 0 ? "<" : "", ends.beyond_last > 0 ? ">" : "", mean / 1e3);
}

std::vector<std::string> MarkedMeans::notes() const {
  std::vector<std::string> notes;
  if (!at_zero_.empty())
    notes.push_back(fmt::format(
        "\"<\": people whose wall was unstable at the first stiffness of the search already count as 0: {}.",
        at_zero_));
  if (!beyond_last_.empty())
    notes.push_back(fmt::format(
        "\">\": people whose wall was stable up to the last stiffness of the search count with that: {}.",
        beyond_last_));
  return notes;
}

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
    if (result.condition.adaptive()) continue;
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
      "{} simulated people, {} touches at every stiffness (approach speeds and pushes{}), in steps of {:g} "
      "N/m. A wall counts as unstable when the handle moves by more than {:g} mm in every quarter of the "
      "last second of a hold. {}",
      first.set.subjects.size(), first.protocol.touches(),
      first.protocol.phases > 1 ? fmt::format(", {} times within a sample", first.protocol.phases) : "",
      first.steps.step, first.protocol.threshold * 1e3,
      any_calibrated(studies) ? "\"Calibrated\" means that friction and activation were fitted to this very "
                                "number; everything else is predicted, without another fit."
                              : "Everything is predicted: friction and activation are as the set has them, "
                                "and were not fitted for these people, this force limit and these touches."));
  if (any_calibrated(studies)) section.paragraphs.emplace_back(worth_words);
  section.paragraphs.push_back(start_words(first));
  if (!first.contact_speeds.empty()) section.paragraphs.push_back(speed_words(first));
  if (!first.changes.empty())
    section.paragraphs.push_back(first.changes.sentence() + " Nothing was fitted again.");
  if (first.changes.changes("wall.touch_stiffness"))
    section.paragraphs.push_back(
        fmt::format("A wall that grows counts as unstable as well when it comes to less than {:g} % of its "
                    "stiffness in the last quarter of that second.",
                    100.0 * TouchSetup().least_rendered_share));
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
      if (result.condition.adaptive()) most = std::max(most, result.mean());
    }
    if (two == nullptr || most == 0.0) continue;
    const double printed = paper::max_stiffness.back().stiffness;
    section.paragraphs.push_back(
        fmt::format("{}: the adaptive wall reaches {} N/mm in its best mode; the paper's is {}, ours {}. It "
                    "is {} a constant 2 N ({}).",
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
      "wall: mass, viscous damping, friction and delay of the device trade against each other and against "
      "how hard people press: other choices meet 3.58 N/mm too (docs/experiments/max_stiffness.md). gamma is "
      "identifiable only together with the force limit: with the force clipped, part of the gain is the "
      "clip's.");
  return section;
}

plot::Figure max_stiffness_figure(const std::vector<MaxStiffnessStudy>& studies) {
  plot::Figure figure;
  figure.title = "Largest stable stiffness, mean of the people";
  figure.x_label = "F_{MC} of the constant field (N)";
  figure.legend_beside = true;
  plot::Panel panel{"largest stable stiffness (N/mm)", {}, {}};
  plot::Series printed{"paper 1", {}, {}};
  printed.points = true;
  for (const paper::MaxStiffness& number : paper::max_stiffness) {
    if (number.adaptive) {
      panel.marks.push_back({number.stiffness / 1e3, false, "paper 1, adaptive"});
      continue;
    }
    // Two points, and no line between them: the paper prints nothing there.
    for (const double y : {number.stiffness / 1e3, std::nan("")}) {
      printed.x.push_back(number.magnetic_coefficient);
      printed.y.push_back(y);
    }
  }
  panel.series.push_back(printed);
  for (const MaxStiffnessStudy& study : studies) {
    const char* clipped = study.set.device.force_limit > 0.0 ? "clipped" : "not clipped";
    plot::Series constant{std::string("constant, ") + clipped, {}, {}};
    constant.points = true;
    for (const ConditionResult& result : study.conditions) {
      if (result.condition.adaptive()) continue;
      constant.x.push_back(result.condition.magnetic_coefficient);
      constant.y.push_back(result.mean() / 1e3);
    }
    panel.series.push_back(constant);
    plot::Series modes{std::string("adaptive, ") + clipped, {}, {}};
    double least = 1e300, most = 0.0;
    for (const ConditionResult& result : study.conditions) {
      if (!result.condition.adaptive()) continue;
      least = std::min(least, result.mean() / 1e3);
      most = std::max(most, result.mean() / 1e3);
    }
    if (most == 0.0) continue;
    const double at = study.set.device.force_limit > 0.0 ? 0.78 : 0.82;  // eq. 7 commands 0.8 N at rest
    modes.x = {at, at};
    modes.y = {least, most};
    modes.points = true;
    panel.series.push_back(modes);
  }
  double top = 0.0;
  for (const plot::Mark& mark : panel.marks) top = std::max(top, mark.at);
  for (const plot::Series& series : panel.series) {
    for (const double y : series.y) top = std::max(top, std::isnan(y) ? 0.0 : y);
  }
  panel.y_limits = {0.0, std::ceil(1.05 * top)};
  figure.panels.push_back(std::move(panel));
  return figure;
}

std::string max_stiffness_caption(const std::vector<MaxStiffnessStudy>& studies) {
  std::vector<std::string> calibrated;
  for (const MaxStiffnessStudy& study : studies) {
    std::string values;
    for (const ConditionResult& result : study.conditions) {
      if (result.condition.origin != report::Origin::calibrated) continue;
      values += fmt::format("{}{:g}", values.empty() ? "" : " and ", result.condition.magnetic_coefficient);
    }
    if (!values.empty()) calibrated.push_back(fmt::format("{} N ({})", values, clip_words(study.set.device)));
  }
  return fmt::format(
      "Largest stable stiffness over F_MC. {}; the adaptive wall, from its worst mode to its best, stands at "
      "the 0.8 N that eq. 7 commands at rest.",
      calibrated.empty() ? std::string("All values of ours are predicted, nothing was fitted to these people")
                         : fmt::format("The values at {} are calibrated, all others of ours predicted",
                                       fmt::join(calibrated, ", ")));
}

report::Picture draw_max_stiffness(const std::vector<MaxStiffnessStudy>& studies,
                                   const std::filesystem::path& file) {
  plot::write_figure(max_stiffness_figure(studies), file);
  return {max_stiffness_caption(studies), file};
}

}  // namespace kmax::experiment
