#pragma once

#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::experiment {

/// Axis 0 pressed against its wall, axis 1 held where it is.
inline simulation::Scene two_held_axes() {
  simulation::Scene scene = simulated_board::factory_scene();
  scene.axes[0].motion->push_force = 2.5;
  scene.axes[0].motion->hold_time = 3.6;
  scene.axes.push_back(scene.axes[0]);
  scene.axes[1].motion->start_position = scene.axes[1].motion->wall_position = 0.0;
  scene.axes[1].motion->push_force = 0.0;
  return scene;
}

}  // namespace kmax::experiment
