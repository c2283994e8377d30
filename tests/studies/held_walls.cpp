#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/wilson_interval.hpp"
#include "tests/studies/studies.hpp"

namespace kmax::studies {
namespace {

constexpr std::string_view named_person = "subject 1";

HeldWall hold(TouchSetup setup, const experiment::TouchProtocol& protocol) {
  HeldWall held;
  setup.threshold = protocol.threshold;
  setup.matrices =
      std::make_shared<simulation::PropagatorTable>(setup.device, setup.person, experiment::study_gain_bits);
  std::vector<experiment::TouchSample> whole;  // asked for, so that every touch goes on to its end
  for (const double speed : protocol.approach_speeds) {
    for (const double push : protocol.pushes) {
      setup.motion.approach_speed = speed;
      setup.motion.push_force = push;
      whole.clear();
      const experiment::TouchOutcome outcome = experiment::simulate_touch(setup, &whole);
      ++held.touches;
      held.unstable += outcome.unstable() ? 1 : 0;
      held.worst = std::max(held.worst, outcome.peak_to_peak);
    }
  }
  return held;
}

const experiment::paper::ContactVerdict* printed_verdict(const StiffnessCondition& condition) {
  for (const auto& verdict : experiment::paper::contact_verdicts) {
    if (verdict.adaptive == condition.adaptive() &&
        (condition.adaptive() || verdict.magnetic_coefficient == condition.magnetic_coefficient))
      return &verdict;
  }
  return nullptr;
}

std::vector<StiffnessCondition> held_conditions() {
  std::vector<StiffnessCondition> conditions = experiment::stiffness_conditions();
  for (StiffnessCondition& rescaled : experiment::rescaled_conditions())
    conditions.push_back(std::move(rescaled));
  return conditions;
}

/// How many of all people, with the 95 % interval that the share leaves for as many others.
std::string people_with_interval(const HeldWallResult& result) {
  const std::size_t all = result.people.size();
  const auto interval = experiment::wilson_interval(result.stable_people(), all);
  const auto of_all = [&](double share) { return share * static_cast<double>(all); };
  return fmt::format("{} ({:.1f} to {:.1f})", result.stable_people(), of_all(interval.low),
                     of_all(interval.high));
}

}  // namespace

std::size_t HeldWallResult::stable_people() const {
  return static_cast<std::size_t>(
      std::count_if(people.begin(), people.end(), std::mem_fn(&HeldWall::stable)));
}

double HeldWallResult::median_worst() const {
  if (people.empty()) return 0.0;
  std::vector<double> sorted;
  for (const HeldWall& held : people) sorted.push_back(held.worst);
  std::sort(sorted.begin(), sorted.end());
  return 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
}

std::vector<HeldWallResult> hold_walls(const SubjectSet& set, double stiffness, const StiffnessRun& run) {
  simulation::OperatorModel named;
  named.activation_gain = set.subjects.front().person.activation_gain;
  std::vector<HeldWallResult> results;
  std::vector<TouchSetup> setups;  // each condition's people, then the named one
  for (const StiffnessCondition& condition : held_conditions()) {
    const auto* verdict = printed_verdict(condition);
    if (verdict == nullptr) continue;
    results.push_back({condition, std::string(verdict->figure), verdict->stable, {}, {}});
    for (const experiment::Subject& subject : set.subjects)
      setups.push_back(experiment::touch_setup(set.device, subject.person, condition));
    setups.push_back(experiment::touch_setup(set.device, named, condition));
  }
  for (TouchSetup& setup : setups) {
    setup.wall.wall.stiffness = static_cast<float>(stiffness);
    setup.integrator = run.integrator;
  }
  const std::vector<HeldWall> held = experiment::collect_jobs<HeldWall>(
      setups.size(), run.threads, [&](std::size_t index) { return hold(setups[index], run.protocol); },
      run.progress);
  auto next = held.begin();
  for (HeldWallResult& result : results) {
    const auto end = next + static_cast<std::ptrdiff_t>(set.subjects.size());
    result.people.assign(next, end);
    result.named = *end;
    next = end + 1;
  }
  return results;
}

namespace {

/// Both numbers of the model are fitted to means between which this stiffness lies.
bool between_targets(const SubjectSet& set, double stiffness) {
  return set.fitted && set.fitted->force_limit == set.device.force_limit &&
         set.fitted->plain_target < stiffness && stiffness < set.fitted->magnetic_target;
}

}  // namespace

report::Table rescaled_table(const experiment::MaxStiffnessStudy& study) {
  using experiment::ConditionResult;
  const std::size_t modes = study.conditions.size() / 2;
  report::Table table{
      fmt::format(
          "Largest stable stiffness, N/mm, mean of the same people with its 95 % interval (Fig. 8: {})",
          n_per_mm(experiment::paper::max_stiffness.back().stiffness)),
      {"adaptive wall", "V in m/s, as printed",
       fmt::format("V x {:.1f}", study.conditions.back().condition.velocity_scale), "more, of each person"},
      {}};
  for (std::size_t n = 0; n < modes; ++n) {
    const ConditionResult &literal = study.conditions[n], &rescaled = study.conditions[modes + n];
    const auto text = [](const ConditionResult& result) {
      return fmt::format("{} ± {}", n_per_mm(result.mean()), n_per_mm(result.interval()));
    };
    ConditionResult more = literal;
    for (std::size_t person = 0; person < more.subjects.size(); ++person)
      more.subjects[person].stiffness =
          rescaled.subjects[person].stiffness - literal.subjects[person].stiffness;
    table.rows.push_back({literal.condition.name, text(literal), text(rescaled), text(more)});
  }
  return table;
}

report::Section held_wall_section(const SubjectSet& set, const std::vector<HeldWallResult>& results) {
  constexpr double held = experiment::paper::contact_stiffness;
  const bool implied = between_targets(set, held);
  report::Table table{
      fmt::format("Stable when none of {} touches is unstable", results.front().named.touches),
      {"condition", "figure", "paper 1", fmt::format("{}, mm p-p", named_person), std::string(named_person),
       "agrees", fmt::format("stable of {} (95 %)", set.subjects.size()), "median worst, mm p-p", "ours is"},
      {}};
  for (const HeldWallResult& result : results) {
    table.rows.push_back({result.condition.name, result.figure, result.paper_stable ? "stable" : "unstable",
                          fmt::format("{:.2f}", result.named.worst * 1e3),
                          result.named.stable() ? "stable" : "unstable",
                          result.named.stable() == result.paper_stable ? "yes" : "no",
                          people_with_interval(result), fmt::format("{:.2f}", result.median_worst() * 1e3),
                          implied && !result.condition.adaptive() &&
                                  experiment::paper::fitted_to(result.condition.magnetic_coefficient)
                              ? "implied by the fit"
                          : result.condition.velocity_scale != 1.0
                              ? "scale picked knowing 8.02"
                              : std::string(report::to_string(report::Origin::predicted))});
  }
  return {
      fmt::format("A wall of {:g} N/mm held (paper 1, Figs. 9 to 12; {})", held / 1e3,
                  experiment::clip_words(set.device)),
      {implied
           ? fmt::format(
                 "No number was fitted to these verdicts, but {} N/mm lies between the two means that were: "
                 "{} N/mm without a field, {} N/mm with 2 N. Figs. 9 and 11 are implied by that fit and test "
                 "nothing; Figs. 10 and 12 do.",
                 held / 1e3, n_per_mm(set.fitted->plain_target), n_per_mm(set.fitted->magnetic_target))
           : std::string("Nothing was fitted to these people with this device."),
       "V of eq. 7 taken as shares of 0.075 m, the half width of a model of the paper's device, is a "
       "hypothesis that was picked because its mean comes near Fig. 8's 8.02 N/mm: its rows test little."},
      {std::move(table)},
      {}};
}

std::vector<report::Section> held_walls(const StudyInput& input) {
  std::vector<report::Section> sections;
  for (const SubjectSet& set : input.sets) {
    sections.push_back(
        held_wall_section(set, hold_walls(set, experiment::paper::contact_stiffness, input.run)));
    std::vector<StiffnessCondition> adaptive = held_conditions();
    std::erase_if(adaptive, [](const StiffnessCondition& condition) { return !condition.adaptive(); });
    sections.back().tables.push_back(
        rescaled_table(experiment::run_max_stiffness_study(set, adaptive, input.run)));
  }
  return sections;
}

}  // namespace kmax::studies
