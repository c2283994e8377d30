// Composition root of the image for QEMU: the application behind the serial port of the ODrive, and SysTick.

#include <cstdint>
#include <optional>

#include "board/links/serial_link.hpp"
#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/priorities.hpp"
#include "board/stm32f405/serial_hardware.hpp"
#include "board/stm32f405/vectors.hpp"
#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/fault_handler.hpp"
#include "drivers/cortex_m/system_tick.hpp"
#include "drivers/stm32f4/clock_tree.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "firmware/application.hpp"

namespace kmax::board {

namespace {

/// As of a board whose crystal runs.
constexpr drivers::stm32f4::ClockFrequencies clocks{drivers::stm32f4::ClockSource::unreadable, 168'000'000,
                                                    42'000'000, 84'000'000};

drivers::cortex_m::InterruptController interrupts{drivers::cortex_m::nvic(), drivers::cortex_m::scb()};
drivers::cortex_m::SystemTick system_tick{drivers::cortex_m::system_tick(), drivers::cortex_m::scb()};
std::optional<firmware::Application> application;
std::optional<SerialLink<SerialHardware<drivers::stm32f4::Interrupt::usart2>>> serial_link;

[[noreturn]] void run() {
  application.emplace(firmware::BoardIdentity{.board_name = "qemu",
                                              .core_clock_hz = clocks.core_hz,
                                              .clock_source = static_cast<std::uint8_t>(clocks.source)});
  odrive_v3::priority::set_all(interrupts);
  if (!system_tick.start(clocks.core_hz, 1'000)) drivers::cortex_m::stop_on_unexpected_interrupt();
  serial_link.emplace(drivers::stm32f4::usart2(), interrupts, clocks.apb1_hz);
  serial_link->start(application->serial());
  for (;;) {
    const std::uint32_t now = system_tick.now_us();
    application->poll(now);
    serial_link->poll(application->serial(), now);
    // QEMU's USART never asks for the interrupt when it has sent.
    if (serial_link->transmitting()) interrupts.pend(drivers::stm32f4::Interrupt::usart2);
    if (application->can().restart_wanted()) drivers::cortex_m::reset_core();
    drivers::cortex_m::wait_for_interrupt();
  }
}

}  // namespace

}  // namespace kmax::board

void kmax::drivers::cortex_m::enter_safe_state() {}

void ISR_system_tick() {
  using namespace kmax;
  board::system_tick.ISR_count();
  // There is no encoder: the axes tick, and refuse to be armed.
  static_cast<void>(board::application->ISR_tick(firmware::TickInput{}));
}

void ISR_usart2() {
  using namespace kmax::board;
  serial_link->ISR_serve(application->serial(), system_tick);
}

int main() {
  kmax::board::run();
}
