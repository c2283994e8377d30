#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

#include <fmt/format.h>
#include <boost/math/distributions/students_t.hpp>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/run_journal.hpp"

namespace kmax::experiment {

namespace {

// Of a search's result in the journal: reads back equal to the last bit.
constexpr auto search_fields = [](auto& result, const auto& field) {
  field("stiffness_n_per_m", result.stiffness);
  field("beyond_last", result.beyond_last);
  field("never_touched", result.never_touched);
  field("ending_speed_m_per_s", result.ending_speed);
  field("ending_push_n", result.ending_push);
  field("ending_peak_to_peak_m", result.ending_peak_to_peak);
  field("saturated_share", result.saturated_share);
  field("touches", result.touches);
  field("event_limit_hits", result.event_limit_hits);
  field("simulated_s", result.simulated_time);
};

// A fit with another force limit is none: part of the gain is the limit's.
report::Origin origin_of(const SubjectSet& set, const StiffnessCondition& condition) {
  if (!set.fitted || set.fitted->force_limit != set.device.force_limit || condition.adaptive())
    return report::Origin::predicted;
  std::optional<double> target;
  if (condition.magnetic_coefficient == 0.0) target = set.fitted->plain_target;
  if (condition.magnetic_coefficient == 2.0) target = set.fitted->magnetic_target;
  return target && condition.paper == target ? report::Origin::calibrated : report::Origin::predicted;
}

MaxStiffness search_from(double taken_for_stable, const TouchSetup& setup, const StiffnessRun& run) {
  if (!(taken_for_stable > run.steps.first)) return search_max_stiffness(setup, run.protocol, run.steps);
  StiffnessSteps steps = run.steps;
  steps.first = taken_for_stable;
  steps.first_adaptive.reset();
  steps.goes_down = false;
  const MaxStiffness shortened = search_max_stiffness(setup, run.protocol, steps);
  if (shortened.stiffness > 0.0) return shortened;
  MaxStiffness whole = search_max_stiffness(setup, run.protocol, run.steps);
  whole.touches += shortened.touches;
  whole.simulated_time += shortened.simulated_time;
  return whole;
}

}  // namespace

std::vector<MaxStiffness> run_stiffness_jobs(const std::vector<StiffnessJob>& jobs, const StiffnessRun& run) {
  return collect_jobs<MaxStiffness>(
      jobs.size(), run.threads,
      [&](std::size_t index) {
        const StiffnessJob& job = jobs[index];
        MaxStiffness result;
        if (run.journal != nullptr) {
          if (const RunJournal::Json* known = run.journal->find(job.name)) {
            read_fields(*known, result, search_fields);
            return result;
          }
        }
        TouchSetup setup = job.setup;
        setup.integrator = run.integrator;
        result = search_from(job.taken_for_stable, setup, run);
        if (run.journal != nullptr) {
          RunJournal::Json json;
          write_fields(json, result, search_fields);
          run.journal->add(job.name, json);
        }
        return result;
      },
      run.progress);
}

CountedEnds counted_ends(std::span<const MaxStiffness> results) {
  CountedEnds ends;
  for (const MaxStiffness& result : results) {
    ends.at_zero += result.stiffness == 0.0 ? 1 : 0;
    ends.beyond_last += result.beyond_last ? 1 : 0;
  }
  return ends;
}

double mean_stiffness(std::span<const MaxStiffness> results) {
  double sum = 0.0;
  for (const MaxStiffness& result : results) sum += result.stiffness;
  return results.empty() ? 0.0 : sum / static_cast<double>(results.size());
}

namespace {
double deviation_of(std::span<const MaxStiffness> results) {
  if (results.size() < 2) return 0.0;
  const double centre = mean_stiffness(results);
  double sum = 0.0;
  for (const MaxStiffness& subject : results) sum += std::pow(subject.stiffness - centre, 2);
  return std::sqrt(sum / static_cast<double>(results.size() - 1));
}
}  // namespace

double mean_interval(std::span<const MaxStiffness> results) {
  const auto people = static_cast<double>(results.size());
  if (people < 2.0) return 0.0;
  return boost::math::quantile(boost::math::students_t(people - 1.0), 0.975) * deviation_of(results) /
         std::sqrt(people);
}

double ConditionResult::mean() const {
  return mean_stiffness(subjects);
}

double ConditionResult::standard_deviation() const {
  return deviation_of(subjects);
}

double ConditionResult::interval() const {
  return mean_interval(subjects);
}

double ConditionResult::largest_saturated_share() const {
  double largest = 0.0;
  for (const MaxStiffness& subject : subjects) largest = std::max(largest, subject.saturated_share);
  return largest;
}

MaxStiffnessStudy run_max_stiffness_study(const SubjectSet& set,
                                          const std::vector<StiffnessCondition>& conditions,
                                          const StiffnessRun& run) {
  const auto setup_of = [&](const Subject& subject, const StiffnessCondition& condition) {
    TouchSetup setup = touch_setup(set.device, subject.person, condition);
    run.changes.apply(setup);
    return setup;
  };
  std::vector<StiffnessJob> jobs;
  for (const StiffnessCondition& condition : conditions) {
    for (const Subject& subject : set.subjects)
      jobs.push_back({fmt::format("{}, {}", condition.name, subject.name), setup_of(subject, condition)});
  }
  const std::vector<MaxStiffness> results = run_stiffness_jobs(jobs, run);
  MaxStiffnessStudy study{set, run.protocol, run.steps, run.changes, 0.0, {}, {}};
  const double touches_at_speed = static_cast<double>(set.subjects.size() * run.protocol.pushes.size());
  for (const double speed : run.protocol.approach_speeds) {
    study.contact_speeds.push_back({speed, 0.0});
    for (const Subject& subject : set.subjects) {
      TouchSetup setup = setup_of(subject, {});
      study.run_up = std::abs(setup.motion.start_position - setup.motion.wall_position);
      setup.motion.approach_speed = speed;
      setup.wall.wall.stiffness = static_cast<float>(run.steps.first);
      for (const double push : run.protocol.pushes) {
        setup.motion.push_force = push;
        study.contact_speeds.back().at_contact += simulate_touch(setup).contact_speed / touches_at_speed;
      }
    }
  }
  // More touches find less: the sets were fitted with the usual ones.
  const bool usual = run.changes.empty() && run.protocol.phases == TouchProtocol{}.phases;
  auto next = results.begin();
  for (const StiffnessCondition& condition : conditions) {
    const auto end = next + static_cast<std::ptrdiff_t>(set.subjects.size());
    study.conditions.push_back({condition, {next, end}});
    study.conditions.back().condition.origin = usual ? origin_of(set, condition) : report::Origin::predicted;
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
