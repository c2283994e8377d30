#pragma once
// Results of a study that nobody ran, for tests of what is said about them.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

inline MaxStiffness found_stiffness(double stiffness) {
  MaxStiffness found;
  found.stiffness = stiffness;
  return found;
}

// Two people, each with the mean; in the order of stiffness_conditions().
inline MaxStiffnessStudy made_up_study(const std::vector<double>& means, bool fitted,
                                       double force_limit = 3.3) {
  MaxStiffnessStudy study;
  study.set.device.force_limit = force_limit;
  study.set.subjects = draw_subjects(2, 1);
  if (fitted) study.set.fitted = Fitted{3580.0, 8410.0, force_limit};
  const auto conditions = stiffness_conditions();
  for (std::size_t n = 0; n < means.size(); ++n) {
    study.conditions.push_back({conditions[n], {found_stiffness(means[n]), found_stiffness(means[n])}});
    if (fitted && (n == 0 || n == 4)) study.conditions[n].condition.origin = report::Origin::calibrated;
  }
  return study;
}

inline std::string paragraphs_of(const report::Section& section) {
  std::string text;
  for (const std::string& paragraph : section.paragraphs) text += paragraph + "\n";
  return text;
}

inline SubjectSet two_people() {
  SubjectSet set;
  set.subjects = draw_subjects(2, 1);
  return set;
}

// A study of few touches and people, for tests.

inline StiffnessRun quick_run(std::size_t threads = 2) {
  StiffnessRun run;
  run.threads = threads;
  run.protocol.approach_speeds = {0.1, 0.5};
  run.protocol.pushes = {0.6};
  return run;
}

inline SubjectSet few_people(std::size_t count, double gain = simulation::OperatorModel{}.activation_gain) {
  SubjectSet set;
  set.name = "few";
  set.subjects = draw_subjects(count, 1);
  for (Subject& subject : set.subjects) subject.person.activation_gain = gain;
  return set;
}

}  // namespace kmax::experiment
