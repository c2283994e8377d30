#pragma once
// A task of few touches and people, for tests.

#include "host_tools/experiment/design/wall_design.hpp"
#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"

namespace kmax::experiment {

inline DesignTask quick_task(std::size_t people = 2) {
  DesignTask task;
  task.set = few_people(people);
  task.protocol.approach_speeds = {0.1, 0.5};
  task.protocol.pushes = {0.6};
  return task;
}

}  // namespace kmax::experiment
