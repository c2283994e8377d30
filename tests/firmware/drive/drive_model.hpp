// The automaton of CiA 402-2 / IEC 61800-7-201 as its tables say it, apart from the code under test.
#pragma once

#include "firmware/drive/axis_state_machine.hpp"

namespace kmax::firmware {

struct DriveModel {
  // The standard's command table ("command coding"), as masks: a bit that is not in the mask does not matter.
  enum class Row { shutdown, switch_on, disable_voltage, quick_stop, enable_operation };
  struct CommandRow {
    Row row;
    unsigned mask, value;
  };
  static constexpr CommandRow command_rows[] = {
      {Row::shutdown, 0x87, 0x06},          // 0xxx x110
      {Row::switch_on, 0x8F, 0x07},         // 0xxx 0111, also "disable operation"
      {Row::disable_voltage, 0x82, 0x00},   // 0xxx xx0x
      {Row::quick_stop, 0x86, 0x02},        // 0xxx x01x
      {Row::enable_operation, 0x8F, 0x0F},  // 0xxx 1111
  };

  // The transitions that these commands make, by the standard's numbers.
  struct Transition {
    int number;
    DriveState from;
    Row command;
    DriveState to;
  };
  static constexpr Transition transitions[] = {
      {2, DriveState::switch_on_disabled, Row::shutdown, DriveState::ready_to_switch_on},
      {3, DriveState::ready_to_switch_on, Row::switch_on, DriveState::switched_on},
      {4, DriveState::switched_on, Row::enable_operation, DriveState::operation_enabled},
      {5, DriveState::operation_enabled, Row::switch_on, DriveState::switched_on},
      {6, DriveState::switched_on, Row::shutdown, DriveState::ready_to_switch_on},
      {7, DriveState::ready_to_switch_on, Row::disable_voltage, DriveState::switch_on_disabled},
      {7, DriveState::ready_to_switch_on, Row::quick_stop, DriveState::switch_on_disabled},
      {8, DriveState::operation_enabled, Row::shutdown, DriveState::ready_to_switch_on},
      {9, DriveState::operation_enabled, Row::disable_voltage, DriveState::switch_on_disabled},
      {10, DriveState::switched_on, Row::disable_voltage, DriveState::switch_on_disabled},
      {10, DriveState::switched_on, Row::quick_stop, DriveState::switch_on_disabled},
      {11, DriveState::operation_enabled, Row::quick_stop, DriveState::quick_stop_active},
      {12, DriveState::quick_stop_active, Row::disable_voltage, DriveState::switch_on_disabled},
  };

  DriveState state = DriveState::not_ready_to_switch_on;
  unsigned previous = 0;
  Refusal refusal = Refusal::none;

  void command(unsigned word, Refusal obstacle, bool cause_remains, bool stays) {
    const unsigned risen = word & ~previous;
    previous = word;
    if (state == DriveState::fault) {
      if ((risen & 0x80) == 0) return;  // 15: a rising edge of bit 7
      refusal = cause_remains ? Refusal::fault_present : Refusal::none;
      if (!cause_remains) state = DriveState::switch_on_disabled;
      return;
    }
    for (const CommandRow& row : command_rows) {
      if ((word & row.mask) == row.value) return obey(row.row, (risen & 0x08) != 0, obstacle, stays);
    }
  }

 private:
  void obey(Row row, bool enable_rises, Refusal obstacle, bool stays) {
    if (row == Row::enable_operation) {
      // This device's own condition, in the states where the command means something.
      if (!enable_rises) return;
      // In "ready to switch on" it makes transitions 3 and 4.
      if (state == DriveState::ready_to_switch_on) state = DriveState::switched_on;
      if (state != DriveState::switched_on) return;
      refusal = obstacle;
      if (obstacle != Refusal::none) return;
    }
    for (const Transition& t : transitions) {
      if (t.from != state || t.command != row) continue;
      state = t.to;
      // 12 by itself, with the option code that asks for it.
      if (t.number == 11 && !stays) state = DriveState::switch_on_disabled;
      return;
    }
  }
};

}  // namespace kmax::firmware
