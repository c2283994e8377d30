#pragma once

#include <cstdint>

namespace kmax::control {

struct BrakeChopperConfig {
  float on_voltage = 0.0f;  ///< V, 0: no brake resistor
  float hysteresis = 0.5f;  ///< V, >= 0: off again this far below
};

/// Switches a brake resistor by the supply voltage, so that a motor that brakes does not pump the supply up.
///
/// Called at the tick rate. The resistor lies between the half-bridge's middle and ground, so only its high
/// side is ever switched on: there is nothing to shoot through. The board ends what each call switches on
/// before the next one, so that the high side's bootstrap capacitor recharges.
///
/// A voltage that is not a number counts as low: off.
class BrakeChopper {
 public:
  struct Coefficients {
    float on_voltage = 0.0f, off_voltage = 0.0f;
  };

  /// Outside the interrupt.
  static constexpr Coefficients prepare(const BrakeChopperConfig& config) {
    return {config.on_voltage, config.on_voltage - config.hysteresis};
  }

  /// True: high side on.
  bool update(const Coefficients& c, float supply_voltage) {
    if (!(c.on_voltage > 0.0f) || !(supply_voltage > c.off_voltage)) on_ = false;
    if (c.on_voltage > 0.0f && supply_voltage >= c.on_voltage) on_ = true;
    return on_;
  }

 private:
  bool on_ = false;
};

}  // namespace kmax::control
