#pragma once

#include "drivers/cortex_m/fault_handler.hpp"
#include "firmware/board_interface/crash_record.hpp"

namespace kmax::board {

/// What the fault handler left in RAM, as the application reports it. Empty after power-on.
inline firmware::CrashRecord crash_record_of(const drivers::cortex_m::FaultRecord& kept) {
  firmware::CrashRecord crash;
  using drivers::cortex_m::FaultCause;
  if (kept.magic != drivers::cortex_m::FaultRecord::valid_magic) return crash;
  crash.count = kept.count;
  crash.is_new = !kept.reported;
  crash.cause = kept.cause == FaultCause::unexpected_interrupt ? firmware::CrashCause::unexpected_interrupt
                                                               : firmware::CrashCause::fault;
  crash.exception_number = static_cast<std::uint16_t>(kept.exception_number);
  if (kept.frame_valid) {
    crash.program_counter = kept.program_counter;
    crash.link_register = kept.link_register;
  }
  crash.status = kept.configurable_status;
  crash.hard_fault_status = kept.hard_fault_status;
  // CFSR says which of the two address registers holds something (PM0214: MMARVALID, BFARVALID).
  constexpr std::uint32_t memory_address_valid = 1U << 7, bus_address_valid = 1U << 15;
  if ((kept.configurable_status & bus_address_valid) != 0) {
    crash.address = kept.bus_fault_address;
  } else if ((kept.configurable_status & memory_address_valid) != 0) {
    crash.address = kept.memory_fault_address;
  }
  return crash;
}

}  // namespace kmax::board
