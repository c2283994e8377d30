#pragma once

#include <cstdint>
#include <string_view>

#include "firmware/board_interface/crash_record.hpp"
#include "firmware/board_interface/retained_count.hpp"
#include "firmware/drive/motor_control.hpp"

namespace kmax::firmware {

inline constexpr std::uint32_t firmware_version = 0x000100;  ///< 0.1.0
inline constexpr std::string_view firmware_version_text = "0.1.0";
inline constexpr std::uint32_t vendor_id = 0;  ///< none assigned by CiA
inline constexpr std::uint32_t product_code = 1;

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
  /// Of the supply, that the current controllers may use: what the board's bridge can give.
  float modulation_limit = MotorControlConfig{}.modulation_limit;
};

}  // namespace kmax::firmware
