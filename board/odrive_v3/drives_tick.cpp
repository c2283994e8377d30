#include "board/odrive_v3/power_hardware.hpp"

namespace kmax::board::odrive_v3 {

// Which axis is a constant of its code: there are two copies of the tick, all that they call inlined.
[[gnu::flatten]] void ISR_tick(Power<PowerHardware>& power, firmware::Application::Tick& axes) {
  power.hardware().ISR_tick_begins();
  if (power.hardware().ISR_sampled_axis_1()) {
    power.ISR_tick(1, axes);
  } else {
    power.ISR_tick(0, axes);
  }
}

void tick_without_power(firmware::Application& application) {
  static_cast<void>(application.ISR_tick(firmware::TickInput{}));
}

}  // namespace kmax::board::odrive_v3
