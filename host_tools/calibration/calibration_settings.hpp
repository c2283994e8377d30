#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "host_tools/calibration/prompter.hpp"

namespace kmax::calibration {

// Steps are chosen by these sets.
enum class StepSet : std::uint8_t { electrical, encoder, mechanical, compensation };
inline constexpr std::array step_set_names = {std::string_view("electrical"), std::string_view("encoder"),
                                              std::string_view("mechanical"),
                                              std::string_view("compensation")};

struct CalibrationSettings {
  std::size_t axis = 0;
  std::array<bool, step_set_names.size()> sets{true, true, true, false};  // by StepSet
  double travel = 0.02;           // m; the handle stays this near to where it is at the beginning
  std::optional<double> current;  // A; without it half of current.limit
  bool keep_pole_pairs = false;   // other pole pairs than motor.pole_pairs are a failure
  bool dry_run = false;           // everything is put back
  bool save = true;               // into the device's memory, if all steps pass
  int repetitions = 3;            // of each measurement, >= 2: their scatter is the spread

  bool has(StepSet set) const { return sets[static_cast<std::size_t>(set)]; }
};

}  // namespace kmax::calibration
