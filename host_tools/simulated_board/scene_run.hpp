#pragma once

#include <optional>
#include <vector>

#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::simulated_board {

/// What is known at one haptic sample of an axis: the true handle, and what the firmware made of it.
struct RunSample {
  double time;                  ///< s since arming
  double true_position;         ///< m, where the encoder is
  double tip_position;          ///< m, where the person holds it; without a structure the same
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
  std::vector<std::vector<RunSample>> samples;  ///< of each axis of the scene; none were taken if not armed
  /// Of the first axis that could not be armed or ended in a fault; else of axis 0.
  std::size_t axis = 0;
  firmware::DriveState end_state{};
  firmware::Refusal refusal{};  ///< why it could not be armed
  firmware::Fault fault{};
  // What follows is axis 0's.
  std::optional<simulation::ContactMeasure> contact;  ///< if there is a person whose hold was long enough
  double judged_from = 0, judged_to = 0;              ///< s
  std::uint32_t alarms = 0;                           ///< so often the device called the wall unstable
  std::optional<double> first_alarm;                  ///< s
  double limited_share = 0;                           ///< of the haptic samples, by force.limit
  double clipped_share = 0;                           ///< of the ticks, by the device
  std::int64_t lost_edges = 0;                        ///< by an encoder without a motor that loses some
  double simulated_s = 0, real_s = 0;
  std::uint64_t firmware_ticks = 0;  ///< since arming, that the firmware ran
};

/// Which of the 20,000 ticks a second the firmware runs.
enum class RunTicks : std::uint8_t {
  every,
  needed,  ///< not those that only hold a force between two samples, board::NativeBoard::advance_held()
};

/// Powers the scene's board up, arms its axes and lets the scene's duration pass. Everything goes through the
/// firmware: no shortcut around its sampling, limits or states. The same scene gives the same numbers,
/// whichever ticks it runs; a scene without motor or encoder defects pays for its haptic ticks only, else for
/// all.
RunResult run_scene(const simulation::Scene& scene, RunTicks ticks = RunTicks::needed);

}  // namespace kmax::simulated_board
