#pragma once
// Figs. 6 and 8 of paper 1 on simulated people: the largest stable stiffness of every condition for every
// person of a set.
//
// A person and a condition are one job. Jobs are independent of each other and of the number of threads: the
// same settings give the same numbers.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/touch_changes.hpp"

namespace kmax::experiment {

// One thing that is looked for: a touch's setup, and what it is called.
struct StiffnessJob {
  std::string name;  // unique within a journal, which knows it by this
  TouchSetup setup;
  // N/m, a step of the run's: what lies below is taken for stable, and the search begins here. If this is not
  // stable, the search is made again from the run's first stiffness. 0: it begins there.
  double taken_for_stable = 0.0;
};

struct StiffnessRun {
  TouchProtocol protocol;
  StiffnessSteps steps;
  // Of every touch of a study; run_stiffness_jobs() takes the touches as they are.
  TouchChanges changes{};
  simulation::IntegratorConfig integrator{};
  std::size_t threads = 1;
  // Of jobs; what it throws ends the run (job_pool.hpp).
  ProgressReport progress;
  // Jobs that are in it are not run again, and those that end are added. May be null.
  RunJournal* journal = nullptr;
};

// In the order of `jobs`. Throws what the progress, the journal or a job throws.
std::vector<MaxStiffness> run_stiffness_jobs(const std::vector<StiffnessJob>& jobs, const StiffnessRun& run);

struct ConditionResult {
  StiffnessCondition condition;
  std::vector<MaxStiffness> subjects;  // in the order of the set's
  double mean() const;                 // N/m
  double standard_deviation() const;   // N/m, of the sample
  double interval() const;             // N/m, mean_interval()
  double largest_saturated_share() const;
};

// How fast the hand wants to be, and how fast the handle is when it meets the plain wall: slower, where the
// run-up is too short for the speed. m/s, mean of people and pushes.
struct ContactSpeed {
  double intended, at_contact;
};

struct MaxStiffnessStudy {
  SubjectSet set;
  TouchProtocol protocol;
  StiffnessSteps steps;
  TouchChanges changes;
  double run_up = 0.0;                       // m
  std::vector<ContactSpeed> contact_speeds;  // of the protocol's speeds
  std::vector<ConditionResult> conditions;
  double simulated_time = 0.0;  // s
  std::uint64_t touches = 0;
  std::uint64_t event_limit_hits = 0;
};

// A condition's number is calibrated if the set says that it was fitted to this very number with the force
// limit it has now, nothing of the touches is changed and there are no more of them than usual, and predicted
// otherwise.
MaxStiffnessStudy run_max_stiffness_study(const SubjectSet& set,
                                          const std::vector<StiffnessCondition>& conditions,
                                          const StiffnessRun& run);

double mean_stiffness(std::span<const MaxStiffness> results);  // N/m
// N/m: the mean of all such people lies within this of the sample's with 95 % (Student); 0 for fewer than
// two. A search that ended before somebody's largest stiffness makes mean and interval too low.
double mean_interval(std::span<const MaxStiffness> results);

// People whose number in a mean is only a bound.
struct CountedEnds {
  std::size_t at_zero = 0;      // unstable at the first stiffness already: counted as 0
  std::size_t beyond_last = 0;  // stable up to the last: counted as that
};
CountedEnds counted_ends(std::span<const MaxStiffness> results);

}  // namespace kmax::experiment
