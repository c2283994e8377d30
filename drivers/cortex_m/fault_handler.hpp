#pragma once

#include <cstdint>

// What is left when the program has gone wrong: a record in RAM that survives the reset, and the reset
// itself.
//
// A fault or an interrupt that nobody handles ends here: the board is put into its safe state, the record is
// written, the core is reset. After the reset the application reads `fault_record`; it is valid when `magic`
// is right.

namespace kmax::drivers::cortex_m {

enum class FaultCause : std::uint32_t {
  fault = 1,                 // HardFault and the configurable faults
  unexpected_interrupt = 2,  // a vector without a handler; `exception_number` says which
};

struct FaultRecord {
  static constexpr std::uint32_t valid_magic = 0x4B46'4C54;

  std::uint32_t magic;
  std::uint32_t count;  // faults since power was applied
  FaultCause cause;
  std::uint32_t exception_number;  // 3 HardFault, 16 + n interrupt n
  std::uint32_t exception_return;  // the EXC_RETURN value
  std::uint32_t stack_pointer;     // address of the stacked frame
  bool frame_valid;                // false: the stack had overflowed, the registers below are zero
  std::uint32_t r0, r1, r2, r3, r12, link_register, program_counter, program_status;
  std::uint32_t configurable_status;   // CFSR
  std::uint32_t hard_fault_status;     // HFSR
  std::uint32_t memory_fault_address;  // MMFAR
  std::uint32_t bus_fault_address;     // BFAR
  bool reported;                       // the application has read it at a start
};

/// Outside .data and .bss: random after power-on, kept over a reset.
extern FaultRecord fault_record;

/// Each board defines it: outputs to their safe level by plain register writes. Runs in a fault, with little
/// stack, possibly before main and with peripheral clocks off.
void enter_safe_state();

/// Restarts the processor and its peripherals. Outputs should be in their safe state.
[[noreturn]] void reset_core();

/// For a handler of an interrupt that should never come. Does not return.
[[noreturn]] void stop_on_unexpected_interrupt();

}  // namespace kmax::drivers::cortex_m
