#pragma once

#include <kmax/export.hpp>

#include <string>
#include <utility>
#include <vector>

namespace kmax {

/// What is known at one haptic sample of a simulated axis.
struct SceneSample {
  double time;           ///< s since arming
  double true_position;  ///< m, where the handle is
  double true_velocity;  ///< m/s
  double hand_position;  ///< m
  double position;       ///< m, as the firmware sees it
  double velocity;       ///< m/s, as it estimates it
  double force;          ///< N, asked of the device
  double applied_force;  ///< N, after the device's own limit
};

struct SceneResult {
  std::string name{};
  std::vector<std::vector<SceneSample>> axes{};
  std::string state{};      ///< CiA 402 state at the end: "operation_enabled"
  std::string fault{};      ///< "none"
  std::string contact{};    ///< "stable", "unstable", "no_contact"; empty without a hold that is judged
  double peak_to_peak = 0;  ///< m, of the hold
  double deepest = 0;       ///< m inside the wall
};

/// Names of the scenes that the library brings.
KMAX_API std::vector<std::string> scene_names();

/// Runs a scene, a TOML file or a supplied one by name, through the firmware on a simulated device, as fast
/// as the processor can. `parameters`: name and value, as Device::set() takes them, in place of the scene's.
/// The same scene gives the same numbers. Any number of threads may run one each. Errors: ValueError;
/// RefusedError if it cannot be armed.
KMAX_API SceneResult run_scene(const std::string& scene,
                               const std::vector<std::pair<std::string, std::string>>& parameters = {});

}  // namespace kmax
