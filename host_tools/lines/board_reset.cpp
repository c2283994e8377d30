#include "host_tools/lines/board_reset.hpp"

#include <thread>

namespace kmax::lines {

void sleep_for(std::chrono::milliseconds duration) {
  std::this_thread::sleep_for(duration);
}

void pulse_reset(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep) {
  const auto reset = gpio.drive(config.required(LineRole::reset), true);
  sleep(reset_time);
  // Driven back, not just released: some GPIO drivers leave a released line at its last level.
  reset->set(false);
  sleep(start_time);
}

void enter_bootloader(GpioLines& gpio, const LinesConfig& config, const Sleep& sleep) {
  config.required(LineRole::reset);  // before BOOT0 moves
  const auto boot0 = gpio.drive(config.required(LineRole::boot0), true);
  pulse_reset(gpio, config, sleep);
  boot0->set(false);
}

}  // namespace kmax::lines
