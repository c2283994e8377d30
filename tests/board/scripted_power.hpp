#pragma once

#include <array>

#include "board/native/native_board.hpp"
#include "tests/board/scripted_device.hpp"

namespace kmax::board {

/// A scripted device behind a power stage whose samples are scripted too.
class ScriptedPower : public ScriptedDevice {
 public:
  firmware::AxisInput sample(std::size_t axis) {
    firmware::AxisInput input{};
    input.count = count(axis);
    input.count_valid = count_valid(axis);
    input.motor = samples[axis];
    input.referenced = referenced[axis];
    input.reference_generation = reference_generation[axis];
    return input;
  }
  firmware::BoardReadings readings() const { return board; }
  void poll(const firmware::Application&, std::uint32_t) {}

  std::array<firmware::MotorControl::Measured, firmware::axis_count> samples{
      {{true, 24.0f, 0.0f, 0.0f}, {true, 24.0f, 0.0f, 0.0f}}};
  std::array<bool, firmware::axis_count> referenced{};
  std::array<std::uint32_t, firmware::axis_count> reference_generation{};
  firmware::BoardReadings board{
      .power_stage_temperature = {30.0f, 31.0f}, .supply_voltage = 24.0f, .has_power_stage = true};
};
static_assert(PoweredDevice<ScriptedPower>);

}  // namespace kmax::board
