#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/host_tools/calibration/calibrated_device.hpp"

namespace kmax::calibration_test {

/// A value beside the truth of the simulated device.
struct Judged {
  std::string name;
  double found, truth;
  double allowed;  ///< share of the truth; absolute if `absolute`
  bool absolute;

  double error() const { return absolute ? std::abs(found - truth) : std::abs(found / truth - 1.0); }
  bool good() const { return error() <= allowed; }
};

/// The encoder's direction and the motor's offset as they are in the scene: the offset is referred to
/// positions that the found direction counts.
inline std::vector<Judged> judge(const simulation::SceneAxis& axis,
                                 const calibration::CalibrationReport& report) {
  std::vector<Judged> all;
  const auto add = [&](const char* name, double truth, double allowed, bool absolute = false) {
    const calibration::IdentifiedValue* value = value_of(report, name);
    all.push_back({name, value != nullptr ? value->value : std::nan(""), truth, allowed, absolute});
  };
  const double leg = axis.inverter.on_resistance;
  if (const auto* dc = std::get_if<simulation::BrushedDcMotorConfig>(&*axis.motor)) {
    add("motor.resistance", dc->resistance + 2.0 * leg, 0.03);
    add("motor.inductance", dc->inductance, 0.03);
    add("motor.torque_constant", dc->torque_constant, 0.03);
  } else {
    const auto& motor = std::get<simulation::SynchronousMotorConfig>(*axis.motor);
    add("motor.resistance", motor.resistance + leg, 0.03);
    add("motor.inductance", motor.inductance_d, 0.03);
    add("motor.inductance_q", motor.inductance_q, 0.03);
    add("motor.torque_constant", motor.torque_constant, 0.03);
    add("motor.pole_pairs", motor.pole_pairs, 0.0, true);
    add("motor.electrical_offset", motor.electrical_offset, 0.5 * std::numbers::pi / 180.0, true);
    Judged& offset = all.back();
    offset.found = offset.truth + std::remainder(offset.found - offset.truth, 2.0 * std::numbers::pi);
  }
  add("encoder.direction", axis.encoder.reversed ? -1.0 : 1.0, 0.0, true);
  add("device.mass", axis.device.mass, 0.10);
  add("friction", axis.device.friction, 0.10);
  return all;
}

inline std::vector<Judged> judge(const CalibratedDevice& device,
                                 const calibration::CalibrationReport& report) {
  return judge(device.axis(), report);
}

}  // namespace kmax::calibration_test
