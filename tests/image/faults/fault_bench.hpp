#pragma once

#include <string>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/parameters/refusal.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests {

/// Both axes in mode torque, each held by a person, so that current flows wherever the handle is.
class FaultBench : public ImageBench {
 public:
  explicit FaultBench(const virtual_board::VirtualBoardConfig& config = {})
      : ImageBench(settings(), 1.0, "motor_axes", config) {}

  /// After each start.
  void begin() {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) write("drive.mode", axis, 2);
  }
  void cycle_power() { board->cycle_power(); }

  void command(std::size_t axis, unsigned word) { write("drive.controlword", axis, word); }
  firmware::DriveState state(std::size_t axis) {
    return firmware::statusword::state_of(reading(firmware::entry_of<"drive.statusword">(), axis));
  }
  firmware::Refusal refusal(std::size_t axis) {
    return static_cast<firmware::Refusal>(reading(firmware::entry_of<"drive.refusal">(), axis));
  }

  /// A host that clears what there is and arms; true: the axis is armed, and makes force a moment later.
  bool arm(std::size_t axis) {
    for (const unsigned word : {0x00, 0x80, 0x00, 0x06, 0x07, 0x0F}) command(axis, word);
    if (state(axis) != firmware::DriveState::operation_enabled) return false;
    write_real("profile.target_force", axis, 2.5f);
    return true;
  }
  void press() { board->run_for(0.1); }

  /// The cause is gone: the host clears until all is well. False: it never is.
  bool recover() {
    for (int tries = 0; tries < 60; ++tries) {
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
        for (const unsigned word : {0x00, 0x80, 0x00}) command(axis, word);
      if (board->healthy()) return true;
      board->run_for(0.01);
    }
    return false;
  }

 private:
  static Parameters settings() {
    Parameters all{{"link.timeout", 0.0},
                   {"supply.voltage_min", 10.0},
                   {"velocity.limit", 10.0},
                   {"axis1.velocity.limit", 10.0}};
    for (const std::string prefix : {"", "axis1."}) {
      all.push_back({prefix + "wall.law", std::string("none")});
      all.push_back({prefix + "force.ramp_time", 0.01});
      all.push_back({prefix + "encoder.index", std::string("once_per_turn")});
    }
    return all;
  }
};

}  // namespace kmax::tests
