#pragma once

#include <chrono>
#include <functional>

#include "host_tools/lines/lines_config.hpp"

// Resets a board by its NRST line, and starts its ROM bootloader by BOOT0 and NRST.

namespace kmax::lines {

using Sleep = std::function<void(std::chrono::milliseconds)>;
void sleep_for(std::chrono::milliseconds duration);

/// An STM32F405 needs NRST low for 20 us (data sheet, NRST pin characteristics), and the usual capacitor of
/// 100 nF is discharged long before: 20 ms leave room for a slow relay or optocoupler.
inline constexpr std::chrono::milliseconds reset_time{20};
/// BOOT0 is sampled at the fourth clock after the reset; ROM bootloaders and the application answer later.
inline constexpr std::chrono::milliseconds start_time{100};

/// Holds the board in reset for reset_time, then gives it start_time.
/// LinesConfigError without a line for it, LineError.
void pulse_reset(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep = sleep_for);

/// BOOT0 to "bootloader", a reset, BOOT0 back: the ROM bootloader runs until the next reset.
void enter_bootloader(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep = sleep_for);

}  // namespace kmax::lines
