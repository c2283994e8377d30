#pragma once

#include <cstddef>
#include <cstdint>

#include "control/finite.hpp"
#include "firmware/drive/axis.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

// Mode torque, CiA 402's cyclic synchronous torque: what a host asks for in thousandths of the rated torque
// and in newtons, as a force at the handle. Main loop.

/// What a host asks for in mode torque: 0 whenever the axis is not armed.
constexpr bool is_target(std::size_t entry) {
  return entry == entry_of<"profile.target_torque">() || entry == entry_of<"profile.target_force">();
}

/// profile.rated_current, mA: current.limit to the nearest whole one; at least 1.
constexpr std::uint32_t rated_current(const ParameterValues& values, std::size_t axis) {
  const auto whole = static_cast<std::uint32_t>(1e3f * values.real<"current.limit">(axis) + 0.5f);
  return whole < 1 ? 1 : whole;
}

/// profile.rated_torque, mN m at the motor's shaft: what current.limit makes, to the nearest whole one; at
/// least 1. Up to 12e6, which float holds exactly.
constexpr std::uint32_t rated_torque(const ParameterValues& values, std::size_t axis) {
  const float torque = values.real<"current.limit">(axis) * values.real<"motor.torque_constant">(axis);
  const auto whole = static_cast<std::uint32_t>(1e3f * torque + 0.5f);
  return whole < 1 ? 1 : whole;
}

/// N at the handle that mode torque asks for now, the sum of two commands, so that neither depends on which
/// was written last:
///
///   profile.target_torque  within +-profile.max_torque, as thousandths of the rated torque that a host
///                          reads; torque = force x device.transmission
///   profile.target_force   as it is
///
/// 0 unless `armed` in mode torque and not `halted`. Always finite. force.limit, force.slew_limit and the
/// motor's current limit are for the tick to keep, as for any other force.
constexpr float commanded_force(const ParameterValues& values, std::size_t axis, bool armed, bool halted) {
  if (!armed || halted || values.choice<DriveMode, "drive.mode">(axis) != DriveMode::torque) return 0.0f;
  const std::int32_t bound = values.whole<"profile.max_torque">(axis);
  std::int32_t thousandths = values.whole<"profile.target_torque">(axis);
  if (thousandths > bound) thousandths = bound;
  if (thousandths < -bound) thousandths = -bound;
  const float rated = 1e-3f * static_cast<float>(rated_torque(values, axis));  // N m
  const float torque = 1e-3f * static_cast<float>(thousandths) * rated;
  return torque / values.real<"device.transmission">(axis) + values.real<"profile.target_force">(axis);
}

}  // namespace kmax::firmware
