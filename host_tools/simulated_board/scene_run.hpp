#pragma once

#include <optional>
#include <vector>

#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::simulated_board {

/// What is known at one haptic sample of axis 0: the true handle, and what the firmware made of it.
struct RunSample {
  double time;                  ///< s since arming
  double true_position;         ///< m
  double true_velocity;         ///< m/s
  double hand_position;         ///< m; without a person the handle's start
  double intended_position;     ///< m
  double position;              ///< m, as the firmware sees it: counted and re-sampled
  double velocity;              ///< m/s, estimated
  double force;                 ///< N, asked of the device
  double applied_force;         ///< N, after the device's own clip
  double magnetic_coefficient;  ///< N
};

struct RunResult {
  std::vector<RunSample> samples;
  firmware::DriveState end_state{};
  firmware::Refusal refusal{};  ///< why it could not be armed
  firmware::Fault fault{};
  std::optional<simulation::ContactMeasure> contact;  ///< if there is a person whose hold was long enough
  double judged_from = 0, judged_to = 0;              ///< s
  double limited_share = 0;                           ///< of the haptic samples, by force.limit
  double clipped_share = 0;                           ///< of the ticks, by the device
  double simulated_s = 0, real_s = 0;
};

/// Powers the scene's board up, arms axis 0 and lets the scene's duration pass. Everything goes through the
/// firmware: no shortcut around its sampling, limits or states. The same scene gives the same numbers.
RunResult run_scene(const simulation::Scene& scene);

}  // namespace kmax::simulated_board
