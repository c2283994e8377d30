#pragma once

#include <cstdint>

namespace kmax::firmware {

/// Why the processor started, as far as the board can tell. The numbers are info.reset_cause.
enum class ResetCause : std::uint8_t {
  unknown = 0,
  power_on = 1,
  pin = 2,
  software = 3,
  independent_watchdog = 4,
  window_watchdog = 5,
  low_power = 6,
  brown_out = 7,
  native = 8,  ///< a process on a PC
};

/// What ended the run before. The numbers are info.crash_cause.
enum class CrashCause : std::uint8_t { none = 0, fault = 1, unexpected_interrupt = 2 };

/// What a board has kept of the last crash over the reset; `count` 0: there was none since power-on.
struct CrashRecord {
  std::uint32_t count = 0;  ///< crashes since power-on
  CrashCause cause = CrashCause::none;
  std::uint16_t exception_number = 0;                    ///< ARMv7-M: 3 hard fault, 16 + n interrupt n
  std::uint32_t program_counter = 0, link_register = 0;  ///< 0 if the stack could not be read
  std::uint32_t status = 0;             ///< Cortex-M4 CFSR (PM0214, configurable fault status register)
  std::uint32_t hard_fault_status = 0;  ///< Cortex-M4 HFSR
  std::uint32_t address = 0;            ///< that was accessed; only if `status` says that it is known
  bool is_new = false;                  ///< it is what ended the run before, not an earlier one
};

}  // namespace kmax::firmware
