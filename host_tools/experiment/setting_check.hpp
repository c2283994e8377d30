#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

#include "host_tools/simulation/operator_model.hpp"

namespace kmax::experiment {

/// Refuses what a simulated experiment cannot be run with. Throws std::invalid_argument that begins with the
/// experiment's name: "jitter: touches = 0: allowed is 1 to 1000".
class SettingCheck {
 public:
  constexpr explicit SettingCheck(const char* experiment) : experiment_(experiment) {}

  /// A value that is not within `least` to `most`; a NaN is not.
  void operator()(const char* name, double value, double least, double most) const {
    if (value >= least && value <= most) return;
    throw std::invalid_argument(
        fmt::format("{}: {} = {}: allowed is {} to {}", experiment_, name, value, least, most));
  }

  /// Nobody to hold the handle.
  void require_somebody(const std::vector<simulation::OperatorModel>& people) const {
    if (people.empty())
      throw std::invalid_argument(
          fmt::format("{}: nobody to hold the handle; give at least one person", experiment_));
  }

 private:
  const char* experiment_;
};

}  // namespace kmax::experiment
