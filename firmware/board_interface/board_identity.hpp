#pragma once

#include <cstdint>
#include <string_view>

#include "firmware/board_interface/crash_record.hpp"
#include "firmware/board_interface/retained_count.hpp"

namespace kmax::firmware {

/// What a board says of itself when it starts.
struct BoardIdentity {
  std::string_view board_name = "unnamed";
  std::uint32_t serial_number = 0;
  std::uint32_t core_clock_hz = 0;
  std::uint8_t clock_source = 0;     ///< as info.clock_source says
  std::uint8_t brown_out_level = 4;  ///< as info.brown_out_level says
  ResetCause reset_cause = ResetCause::unknown;
  CrashRecord crash{};                     ///< what is left of the run before
  RetainedCount* lock_attempts = nullptr;  ///< where WriteLock counts over resets; null: nowhere
  float supply_ceiling = 0.0f;             ///< V, as supply.ceiling says
};

}  // namespace kmax::firmware
