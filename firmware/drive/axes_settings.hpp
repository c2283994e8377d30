#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/drive/axes_tick.hpp"

namespace kmax::firmware {

/// What all axes' tick works by, made from the parameters and from what holds beside them. Whoever owns it
/// says when, and hands it over.
///
/// Main loop only. No failure: the parameters' rules have seen to it that every set can be worked by.
class AxesSettings {
 public:
  using Settings = AxesTick<axis_count>::Settings;

  /// What an axis' settings depend on beside the parameters.
  struct Circumstances {
    float current_share = 1.0f;         ///< of current.limit that the temperatures leave
    float winding_temperature = 25.0f;  ///< degC, in steps
    bool commutated = true;             ///< the rotor's angle is known
    float modulation_limit = 0.0f;      ///< see BoardReadings
    friend constexpr bool operator==(const Circumstances&, const Circumstances&) = default;
  };
  using AllCircumstances = std::array<Circumstances, axis_count>;

  /// What a count and a step of position.resolution are; to work it out takes a division in double.
  struct Scale {
    double count_length = 0.0;  ///< m
    float resolution = 0.0f;    ///< m
  };

  /// For axes that stand at their counters' zero.
  explicit AxesSettings(const ParameterValues& values) { make(values, 0, {}, {}); }

  /// `restarts`: how often a parameter has changed that restarts the estimators. `reports`: where the axes
  /// are.
  [[gnu::cold]] void make(const ParameterValues& values, std::uint32_t restarts, const AllCircumstances& now,
                          const std::array<AxisReport, axis_count>& reports);

  const Settings& all() const { return settings_; }
  const AxisSetting& of(std::size_t axis) const { return settings_.axis[axis]; }
  const Scale& scale(std::size_t axis) const { return scale_[axis]; }
  /// Those by which they were made.
  const AllCircumstances& circumstances() const { return circumstances_; }
  /// Of a tick that works by them, see AxisSetting::generation.
  std::uint32_t generation() const { return settings_.axis[0].generation; }

 private:
  Settings settings_{};
  std::array<Scale, axis_count> scale_{};
  AllCircumstances circumstances_{};
};

}  // namespace kmax::firmware
