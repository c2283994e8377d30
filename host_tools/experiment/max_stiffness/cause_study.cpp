#include "host_tools/experiment/max_stiffness/cause_study.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kmax::experiment {
namespace {

/// Every condition with every person, results by condition.
std::vector<std::vector<MaxStiffness>> by_condition(const SubjectSet& set, const StiffnessRun& run,
                                                    const std::vector<CauseCondition>& conditions) {
  StiffnessRun low = run;
  low.steps.first = cause_first_stiffness;
  std::vector<StiffnessJob> jobs;
  for (const CauseCondition& condition : conditions) {
    for (const Subject& subject : set.subjects) {
      StiffnessJob job{
          fmt::format("cause: {}, x_0 {:g} mm, {}, limit {:g} N, from {:g} N/m", condition.name,
                      condition.magnetic_length * 1e3, subject.name, set.device.force_limit, low.steps.first),
          touch_setup(set.device, subject.person, {})};
      condition.apply(job.setup);
      jobs.push_back(std::move(job));
    }
  }
  const std::vector<MaxStiffness> all = run_stiffness_jobs(jobs, low);
  std::vector<std::vector<MaxStiffness>> results;
  for (auto next = all.begin(); next != all.end();) {
    const auto end = next + static_cast<std::ptrdiff_t>(set.subjects.size());
    results.emplace_back(next, end);
    next = end;
  }
  return results;
}

}  // namespace

std::vector<CauseResult> run_cause_study(const SubjectSet& set, const StiffnessRun& run) {
  const double grown = 1.0 + 2.0 * set.subjects.front().person.activation_gain;
  const std::vector<CauseCondition> conditions = cause_conditions(grown);
  const auto found = by_condition(set, run, conditions);
  std::vector<CauseResult> results;
  for (std::size_t n = 0; n < conditions.size(); ++n) {
    CauseResult result{conditions[n], mean_stiffness(found[n])};
    result.ends = counted_ends(found[n]);
    for (const MaxStiffness& person : found[n])
      result.saturated_share = std::max(result.saturated_share, person.saturated_share);
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<FieldLengthResult> run_field_lengths(const SubjectSet& set, const std::vector<double>& lengths,
                                                 const StiffnessRun& run) {
  std::vector<CauseCondition> conditions;
  for (const double length : lengths) {
    CauseCondition condition{"field alone", "the field in front of the wall and its preload", true};
    condition.magnetic_length = length;
    conditions.push_back(condition);
  }
  const auto found = by_condition(set, run, conditions);
  std::vector<FieldLengthResult> results;
  for (std::size_t n = 0; n < lengths.size(); ++n)
    results.push_back({lengths[n], 2.0 * 2.0 / lengths[n], mean_stiffness(found[n]), counted_ends(found[n])});
  return results;
}

}  // namespace kmax::experiment
