// Composition root of the ODrive v3.6: names the peripherals, gives them their pins and priorities, and hands
// time, bytes and counts to the application.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "board/odrive_v3/pins.hpp"
#include "board/odrive_v3/priorities.hpp"
#include "board/stm32f405/fault_handler.hpp"
#include "board/stm32f405/unique_id.hpp"
#include "board/stm32f405/vectors.hpp"
#include "drivers/stm32f4/clock_tree.hpp"
#include "drivers/stm32f4/core_instructions.hpp"
#include "drivers/stm32f4/gpio.hpp"
#include "drivers/stm32f4/interrupt_controller.hpp"
#include "drivers/stm32f4/peripheral_clock.hpp"
#include "drivers/stm32f4/system_tick.hpp"
#include "drivers/stm32f4/usart.hpp"
#include "firmware/application.hpp"

namespace kmax::board {

namespace {

namespace stm32 = drivers::stm32f4;

stm32::InterruptController interrupts{stm32::nvic(), stm32::scb()};
stm32::SystemTick tick{stm32::system_tick(), stm32::scb()};
stm32::Usart serial{stm32::usart2()};

/// Made in main, once the clocks are known; no interrupt is enabled before.
std::optional<firmware::Application> application;

/// Set by the serial interrupt, taken by the main loop; the time is written before the flag.
std::uint32_t reply_sent_us;
std::atomic<bool> reply_sent;

void apply(std::span<const odrive_v3::PinState> states) {
  for (const auto& [pin, config] : states)
    stm32::GpioPin{stm32::gpio(pin.port), pin.number}.configure(config);
}

void switch_power_stage_off() {
  stm32::enable_peripheral_clock(stm32::rcc().ahb1enr,
                                 stm32::rcc_ahb1enr::GpioA::mask | stm32::rcc_ahb1enr::GpioB::mask |
                                     stm32::rcc_ahb1enr::GpioC::mask | stm32::rcc_ahb1enr::GpioD::mask);
  apply(odrive_v3::power_stage_off);
}

/// 8E1 at the wanted rate; false when this clock cannot make it.
bool configure_serial(const firmware::SerialSettings& settings, const stm32::ClockFrequencies& clocks) {
  interrupts.disable(stm32::Interrupt::usart2);
  const bool configured = serial.configure({settings.baud_rate, stm32::UsartParity::even}, clocks.apb1_hz);
  interrupts.enable(stm32::Interrupt::usart2);
  return configured;
}

/// Follows the application's wish, but not in the middle of a reply. A rate that this clock cannot make
/// leaves the line as it was.
class SerialLine {
 public:
  explicit SerialLine(const stm32::ClockFrequencies& clocks) : clocks_(clocks) {}

  void start() {
    stm32::enable_peripheral_clock(stm32::rcc().apb1enr, stm32::rcc_apb1enr::Usart2::mask);
    apply(odrive_v3::serial_pins);
    interrupts.set_priority(stm32::Interrupt::usart2, odrive_v3::priority::serial);
    settings_ = application->serial_settings();
    if (!configure_serial(settings_, clocks_)) static_cast<void>(configure_serial({115'200}, clocks_));
  }

  void poll() {
    if (reply_sent.exchange(false)) application->serial_reply_sent(reply_sent_us);
    if (serial.transmitting()) {
      // On silicon TXE and TC ask for the interrupt themselves. QEMU's USART never does, and a handler that
      // finds nothing to do costs little, so a reply that is under way is pushed along once per pass.
      interrupts.pend(stm32::Interrupt::usart2);
      return;
    }
    const std::span<const std::uint8_t> reply = application->serial_reply_due(tick.now_us());
    if (serial.transmit(reply)) return;
    const firmware::SerialSettings wanted = application->serial_settings();
    if (wanted == settings_) return;
    settings_ = wanted;
    static_cast<void>(configure_serial(settings_, clocks_));
  }

 private:
  stm32::ClockFrequencies clocks_;
  firmware::SerialSettings settings_{};
};

[[noreturn]] void run() {
  switch_power_stage_off();
  const stm32::ClockFrequencies clocks = stm32::ClockTree{stm32::rcc(), stm32::pwr(), stm32::flash()}.start();

  firmware::BoardIdentity identity{};
  identity.board_name = "odrive_v3";
  // An emulator without clocks does not have the identity words either, and reading them there is a bus
  // fault.
  identity.serial_number =
      clocks.source == stm32::ClockSource::unreadable ? 0 : serial_number_from_unique_id();
  identity.core_clock_hz = clocks.core_hz;
  identity.clock_source = static_cast<std::uint8_t>(clocks.source);
  application.emplace(identity);

  interrupts.set_priority(stm32::SystemException::system_tick, odrive_v3::priority::tick);
  // Each core clock of the clock tree is a whole number of MHz and of ticks.
  if (!tick.start(clocks.core_hz, firmware::tick_rate_hz)) stop_on_unexpected_interrupt();
  SerialLine line{clocks};
  line.start();

  for (;;) {
    application->poll(tick.now_us());
    line.poll();
    // Work that arrives between the poll and here waits for the next interrupt, at most one tick.
    stm32::wait_for_interrupt();
  }
}

}  // namespace

void enter_safe_state() {
  // The pins' latches first, then the direction, in case the pins were not set up yet.
  switch_power_stage_off();
}

}  // namespace kmax::board

void ISR_system_tick() {
  using namespace kmax;
  board::tick.ISR_count();
  // No encoder is read yet, and none is claimed: the axes tick, and refuse to be armed.
  constexpr firmware::TickInput input{{{{0, false}, {0, false}}}};
  static_cast<void>(board::application->ISR_tick(input));
}

void ISR_usart2() {
  using namespace kmax;
  const drivers::stm32f4::UsartEvent event = board::serial.ISR_serve();
  if (!event.received && !event.line_error && !event.transmission_complete) return;
  const std::uint32_t now = board::tick.now_us();
  if (event.received || event.line_error)
    board::application->ISR_serial_byte(event.byte, event.line_error, now);
  if (event.transmission_complete) {
    board::reply_sent_us = now;
    board::reply_sent.store(true);
  }
}

int main() {
  kmax::board::run();
}
