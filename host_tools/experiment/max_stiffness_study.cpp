#include "host_tools/experiment/max_stiffness_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/max_stiffness_json.hpp"

namespace kmax::experiment {

std::vector<MaxStiffness> run_stiffness_jobs(const std::vector<StiffnessJob>& jobs, const StiffnessRun& run) {
  return collect_jobs<MaxStiffness>(
      jobs.size(), run.threads,
      [&](std::size_t index) {
        const StiffnessJob& job = jobs[index];
        if (run.journal != nullptr) {
          if (const RunJournal::Json* known = run.journal->find(job.name)) return max_stiffness_from(*known);
        }
        TouchSetup setup = job.setup;
        setup.integrator = run.integrator;
        const MaxStiffness result = search_max_stiffness(setup, run.protocol, run.steps);
        if (run.journal != nullptr) run.journal->add(job.name, json_of(result));
        return result;
      },
      run.progress);
}

double mean_stiffness(std::span<const MaxStiffness> results) {
  double sum = 0.0;
  for (const MaxStiffness& result : results) sum += result.stiffness;
  return results.empty() ? 0.0 : sum / static_cast<double>(results.size());
}

double ConditionResult::mean() const {
  return mean_stiffness(subjects);
}

double ConditionResult::standard_deviation() const {
  if (subjects.size() < 2) return 0.0;
  const double centre = mean();
  double sum = 0.0;
  for (const MaxStiffness& subject : subjects) sum += std::pow(subject.stiffness - centre, 2);
  return std::sqrt(sum / static_cast<double>(subjects.size() - 1));
}

double ConditionResult::largest_saturated_share() const {
  double largest = 0.0;
  for (const MaxStiffness& subject : subjects) largest = std::max(largest, subject.saturated_share);
  return largest;
}

MaxStiffnessStudy run_max_stiffness_study(const SubjectSet& set,
                                          const std::vector<StiffnessCondition>& conditions,
                                          const StiffnessRun& run) {
  std::vector<StiffnessJob> jobs;
  for (const StiffnessCondition& condition : conditions) {
    for (const Subject& subject : set.subjects)
      jobs.push_back({fmt::format("{}, {}", condition.name, subject.name),
                      touch_setup(set.device, subject.person, condition)});
  }
  const std::vector<MaxStiffness> results = run_stiffness_jobs(jobs, run);
  MaxStiffnessStudy study{set, run.protocol, run.steps, {}};
  auto next = results.begin();
  for (const StiffnessCondition& condition : conditions) {
    const auto end = next + static_cast<std::ptrdiff_t>(set.subjects.size());
    study.conditions.push_back({condition, {next, end}});
    next = end;
  }
  for (const MaxStiffness& result : results) {
    study.simulated_time += result.simulated_time;
    study.touches += result.touches;
    study.event_limit_hits += result.event_limit_hits;
  }
  return study;
}

}  // namespace kmax::experiment
