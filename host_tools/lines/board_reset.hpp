#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "host_tools/lines/lines_config.hpp"

// Resets a board by its NRST line, and starts its ROM bootloader by BOOT0 and NRST.

namespace kmax::lines {

using Sleep = std::function<void(std::chrono::milliseconds)>;
inline void sleep_for(std::chrono::milliseconds duration) {
  std::this_thread::sleep_for(duration);
}

/// An STM32F405 needs NRST low for 20 us (data sheet, NRST pin characteristics), and the usual capacitor of
/// 100 nF is discharged long before: 20 ms leave room for a slow relay or optocoupler.
inline constexpr std::chrono::milliseconds reset_time{20};
/// BOOT0 is sampled at the fourth clock after the reset; ROM bootloaders and the application answer later.
inline constexpr std::chrono::milliseconds start_time{100};

/// Holds the board in reset for reset_time, then gives it start_time.
/// LinesConfigError without a line for it, LineError.
inline void pulse_reset(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep = sleep_for) {
  const auto reset = gpio.drive(config.required(LineRole::reset), true);
  sleep(reset_time);
  // Driven back, not just released: some GPIO drivers leave a released line at its last level.
  reset->set(false);
  sleep(start_time);
}

/// BOOT0 to "bootloader", a reset, BOOT0 back: the ROM bootloader runs until the next reset.
inline void enter_bootloader(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep = sleep_for) {
  config.required(LineRole::reset);  // before BOOT0 moves
  const auto boot0 = gpio.drive(config.required(LineRole::boot0), true);
  pulse_reset(gpio, config, sleep);
  boot0->set(false);
}

}  // namespace kmax::lines
