#pragma once

#include <algorithm>
#include <cstdint>

#include "control/thermal_derating.hpp"
#include "control/winding_temperature.hpp"

namespace kmax::firmware {

struct ThermalSupervisorConfig {
  control::WindingTemperatureConfig<float> winding{};
  float motor_limit = 120.0f;        ///< degC of the winding; 0: not supervised
  float power_stage_limit = 100.0f;  ///< degC
  float derating = 20.0f;            ///< K below either limit over which the current limit falls to zero
};

/// One axis' temperatures in the main loop: the winding's, computed from its current, and the power stage's,
/// measured. Says how much of the current limit is left, and when it is too hot for any.
///
/// The winding begins at the ambient temperature, also after a restart with a hot motor: nothing is kept. A
/// winding temperature that cannot be computed counts as too hot.
///
/// Cost: the model is stepped every 10 ms, about 300 instructions.
class ThermalSupervisor {
 public:
  /// Steps in which the allowance changes: every change makes new settings for the tick.
  static constexpr int steps = 32;

  /// Keeps the present temperatures.
  void configure(const ThermalSupervisorConfig& config) {
    config_ = config;
    coefficients_ = Winding::prepare(config.winding);
    if (!started_) {
      model_.reset(config.winding.ambient_temperature);
      winding_ = resistance_temperature_ = config.winding.ambient_temperature;
      ++changes_;
    }
    compare();
  }

  /// `now_us`: a microsecond clock that wraps. `mean_square_current`: A^2, low-passed over about 10 ms.
  /// `power_stage_temperature`: degC, NaN from a broken sensor.
  void poll(std::uint32_t now_us, float mean_square_current, float power_stage_temperature) {
    constexpr std::uint32_t step_us = 10'000;
    power_stage_ = power_stage_temperature;
    if (!started_) {
      started_ = true;
      last_us_ = now_us - step_us;
    }
    const std::uint32_t elapsed_us = now_us - last_us_;
    if (elapsed_us >= step_us) {
      last_us_ = now_us;
      step(static_cast<float>(elapsed_us) * 1e-6f, mean_square_current);
    }
    compare();
  }

  /// degC; NaN: could not be computed.
  float winding_temperature() const { return winding_; }
  /// The winding's temperature for its resistance, in steps of 5 K; of a temperature that could be computed.
  float resistance_temperature() const { return resistance_temperature_; }
  /// Share of current.limit that may flow, a whole number of 1/steps, rounded up.
  float allowance() const { return static_cast<float>(allowed_steps_) / static_cast<float>(steps); }
  /// Rises when one of these two changes.
  std::uint32_t changes() const { return changes_; }
  bool motor_too_hot() const { return motor_too_hot_; }
  /// Also with a broken sensor.
  bool power_stage_too_hot() const { return power_stage_too_hot_; }

 private:
  void step(float seconds, float mean_square_current) {
    winding_ = model_.update(coefficients_, seconds, mean_square_current);
    allow(share() * static_cast<float>(steps));
    constexpr float worth = 5.0f;  // K, 2 % of the resistance
    const float warmer = winding_ - resistance_temperature_;
    if (warmer > worth || warmer < -worth) {
      resistance_temperature_ = winding_;
      ++changes_;
    }
  }

  void compare() {
    motor_too_hot_ = config_.motor_limit > 0.0f && !(winding_ < config_.motor_limit);
    power_stage_too_hot_ = !(power_stage_ <= config_.power_stage_limit);
  }

  /// Falls at once, and rises half a step later than it fell, so that noise does not make it flutter.
  void allow(float wanted) {
    const auto below = static_cast<float>(allowed_steps_ - 1);
    if (wanted > below && wanted <= below + 1.5f) return;
    auto whole = static_cast<int>(wanted);
    if (static_cast<float>(whole) < wanted) ++whole;
    allowed_steps_ = whole;
    ++changes_;
  }

  using Winding = control::WindingTemperature<float>;

  float share() const {
    const float stage = control::thermal_derating(power_stage_, config_.power_stage_limit - config_.derating,
                                                  config_.power_stage_limit);
    if (!(config_.motor_limit > 0.0f)) return stage;
    const float motor =
        control::thermal_derating(winding_, config_.motor_limit - config_.derating, config_.motor_limit);
    return std::min(stage, motor);
  }

  ThermalSupervisorConfig config_{};
  Winding::Coefficients coefficients_{};
  Winding model_{};
  float winding_ = 25.0f, power_stage_ = 25.0f, resistance_temperature_ = 25.0f;
  int allowed_steps_ = steps;
  std::uint32_t last_us_{}, changes_{};
  bool started_ = false, motor_too_hot_ = false, power_stage_too_hot_ = false;
};

}  // namespace kmax::firmware
