#pragma once
// A study of few touches and people, for tests.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

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
