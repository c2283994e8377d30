// Composition root of the ODrive v3.6: names the peripherals, gives them their pins and priorities, and hands
// time, bytes, counts and currents to the application.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "board/links/can_link.hpp"
#include "board/links/serial_link.hpp"
#include "board/links/usb_link.hpp"
#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/odrive_v3/power_hardware.hpp"
#include "board/odrive_v3/priorities.hpp"
#include "board/odrive_v3/voltage_variant.hpp"
#include "board/stm32f405/boot_loader.hpp"
#include "board/stm32f405/can_hardware.hpp"
#include "board/stm32f405/crash_record.hpp"
#include "board/stm32f405/memory_rights.hpp"
#include "board/stm32f405/serial_hardware.hpp"
#include "board/stm32f405/unique_id.hpp"
#include "board/stm32f405/usb_hardware.hpp"
#include "board/stm32f405/vectors.hpp"
#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/fault_handler.hpp"
#include "drivers/cortex_m/system_tick.hpp"
#include "drivers/periodic_timer.hpp"
#include "drivers/stm32f4/clock_tree.hpp"
#include "drivers/stm32f4/external_interrupt.hpp"
#include "drivers/stm32f4/flash_sectors.hpp"
#include "drivers/stm32f4/independent_watchdog.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/system_memory.hpp"
#include "drivers/stm32f4/reset_cause.hpp"
#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"

extern "C" {
extern volatile std::uint32_t kmax_parameters_begin[];
}

namespace kmax::board {

namespace {

namespace cortex = drivers::cortex_m;
namespace stm32 = drivers::stm32f4;
using namespace odrive_v3;

/// The main loop's heartbeat and the microsecond clock; where the clock is too slow for the power stage, the
/// axes tick with it, so that parameters can be set and read there.
constexpr std::uint32_t clock_rate_hz = 1'000;

/// Longer than an erase of the parameter flash, during which nothing runs.
constexpr std::uint32_t watchdog_ms = 1'000;
static_assert(watchdog_ms > stm32::longest_erase_ms);

cortex::InterruptController interrupts{cortex::nvic(), cortex::scb()};
cortex::SystemTick system_tick{cortex::system_tick(), cortex::scb()};
stm32::ExternalInterrupts line_interrupts{stm32::exti(), stm32::syscfg()};
stm32::IndependentWatchdog watchdog{stm32::iwdg(), stm32::dbgmcu()};

using ParameterFlash = stm32::FlashSectors<>;
static_assert(firmware::ParameterStore<ParameterFlash>::longest <= ParameterFlash::words_per_sector);
std::span<volatile std::uint32_t, ParameterFlash::words_per_sector> parameter_sector(std::size_t index) {
  return std::span<volatile std::uint32_t, ParameterFlash::words_per_sector>{
      kmax_parameters_begin + index * ParameterFlash::words_per_sector, ParameterFlash::words_per_sector};
}
ParameterFlash parameter_flash{stm32::flash(), {{{1, parameter_sector(0)}, {2, parameter_sector(1)}}}};

[[gnu::section(".ccm_noinit")]] firmware::FaultLogMemory log_memory;
/// Fills what the tick's code leaves of SRAM1: see linker.ld.
[[gnu::section(".sram_noinit")]] std::array<std::uint32_t, firmware::capture_words> capture_memory;

[[gnu::section(".noinit")]] firmware::RetainedCount lock_attempts;
[[gnu::section(".noinit")]] firmware::RetainedCount boot_loader_asked;

[[gnu::section(".ccm")]] std::optional<firmware::Application> application;
/// Raised by the links' interrupts: they have left something for the main loop.
firmware::InterruptSignal links_due;
std::optional<SerialLink<SerialHardware<stm32::Interrupt::usart2>>> serial_link;
std::optional<CanLink<CanHardware>> can_link;
std::optional<UsbLink<UsbHardware, cortex::SystemTick<>>> usb_link;
ChipBus chip_bus{stm32::spi3()};
/// Made in main, once the clocks are known; no interrupt is enabled before. DMA reads of it.
std::optional<Power<PowerHardware>> power;
/// Set by the clock's interrupt and never taken back: only a restart brings the ticks back.
std::atomic<bool> ticks_have_stopped{false};
bool power_runs = false;  ///< written before the interrupts that read it are enabled

void apply(std::span<const PinState> states) {
  for (const auto& [pin, config] : states)
    stm32::GpioPin{stm32::gpio(pin.port), pin.number}.configure(config);
}

void switch_power_stage_off() {
  stm32::enable_peripheral_clock(stm32::rcc().ahb1enr,
                                 stm32::rcc_ahb1enr::GpioA::mask | stm32::rcc_ahb1enr::GpioB::mask |
                                     stm32::rcc_ahb1enr::GpioC::mask | stm32::rcc_ahb1enr::GpioD::mask);
  apply(power_stage_off);
}

/// Of the maker's one-time-programmable area.
constexpr auto otp_byte = [](std::size_t i) -> std::uint8_t {
  // NOLINTNEXTLINE(performance-no-int-to-ptr)
  return reinterpret_cast<const volatile std::uint8_t*>(stm32::otp_base)[i];
};

VoltageVariant voltage_variant() {
  return voltage_variant_from_otp(otp_byte).value_or(variant_of_blank_board);
}

/// Major, minor and patch are a byte each, and stay below ten.
firmware::usb::DeviceIdentity usb_identity(std::uint32_t serial_number) {
  constexpr std::uint32_t version = firmware::firmware_version;
  return {serial_number, static_cast<std::uint16_t>((version >> 16 & 0xF) << 8 | (version >> 8 & 0xF) << 4 |
                                                    (version & 0xF))};
}

firmware::BoardIdentity identity(const stm32::ClockFrequencies& clocks, VoltageVariant variant) {
  firmware::BoardIdentity identity{};
  identity.board_name = description.name;
  identity.serial_number = serial_number_from_unique_id();
  identity.core_clock_hz = clocks.core_hz;
  identity.supply_ceiling = supply_ceiling(variant);
  identity.clock_source = static_cast<std::uint8_t>(clocks.source);
  identity.brown_out_level =
      static_cast<std::uint8_t>(stm32::flash_optcr::BrownOutLevel::read(stm32::flash().optcr));
  identity.reset_cause = static_cast<firmware::ResetCause>(stm32::take_reset_cause(stm32::rcc()));
  if (identity.reset_cause == firmware::ResetCause::power_on) {
    cortex::fault_record.magic = 0;
    lock_attempts.set(0);
  }
  identity.lock_attempts = &lock_attempts;
  identity.crash = crash_record_of(cortex::fault_record);
  cortex::fault_record.reported = true;
  return identity;
}

void start_line_interrupts() {
  static_cast<void>(line_interrupts.configure(pins::gate_driver_fault, stm32::Edge::falling));
  static_cast<void>(line_interrupts.configure(pins::emergency_stop, stm32::Edge::rising));
  interrupts.enable(stm32::Interrupt::exti2);
  interrupts.enable(stm32::Interrupt::exti4);
  line_interrupts.enable(pins::gate_driver_fault.number);
  line_interrupts.enable(pins::emergency_stop.number);
}

/// Timers, converters and lines. False where they do not exist.
bool start_power(const stm32::ClockFrequencies& clocks) {
  stm32::enable_peripheral_clock(stm32::rcc().ahb1enr, stm32::rcc_ahb1enr::Dma2::mask);
  stm32::enable_peripheral_clock(stm32::rcc().apb1enr,
                                 stm32::rcc_apb1enr::Timer2::mask | stm32::rcc_apb1enr::Timer3::mask |
                                     stm32::rcc_apb1enr::Timer4::mask | stm32::rcc_apb1enr::Spi3::mask);
  stm32::enable_peripheral_clock(stm32::rcc().apb2enr,
                                 stm32::rcc_apb2enr::Timer1::mask | stm32::rcc_apb2enr::Timer8::mask |
                                     stm32::rcc_apb2enr::Adc1::mask | stm32::rcc_apb2enr::Adc2::mask |
                                     stm32::rcc_apb2enr::Adc3::mask |
                                     stm32::rcc_apb2enr::SystemConfiguration::mask);
  apply(analog_pins);
  apply(encoder_pins);
  apply(line_pins);
  apply(bus_pins);
  // The chips' delays count cycles.
  static_cast<void>(cortex::CycleCounter{cortex::dwt(), cortex::core_debug()}.start());
  if (!chip_bus.configure({})) return false;
  if (!power->hardware().configure(clocks.apb2_hz)) return false;
  const std::uint32_t converters_on_us = system_tick.now_us();
  // Only now: until here the gates were inputs with pull-downs.
  apply(gate_pins);
  power->take_parameters(*application);
  power_runs = true;
  start_line_interrupts();
  interrupts.enable(stm32::Interrupt::adc);
  while (system_tick.now_us() - converters_on_us <= stm32::adc_stabilization_us) {
  }
  return power->hardware().start();
}

/// Cycles that the longest interrupt has taken which ended a sleep, with those behind it that did not let the
/// core back: the longest tick, as it really is, without an instruction of its own for it.
std::uint32_t longest_tick = 0;
volatile bool usb_interrupted = false;  ///< since longest_tick was looked at; the interrupt sets it

drivers::PeriodicTimer power_timer{1'000};

/// What the main loop does for the power stage, once a millisecond, and at once when there is something to
/// take over: nothing in it changes faster, and the lines have interrupts of their own. What has been read is
/// for the next round: an answer on the bus does not wait for it.
void poll_power(std::uint32_t now_us) {
  const bool due = power_timer.due(now_us);
  if (!due && !power->has_to_take_over(*application)) return;
  power->poll(*application, now_us);
  firmware::BoardReadings readings = power->readings();
  readings.longest_tick = longest_tick;
  readings.ticks_have_stopped = ticks_have_stopped.load(std::memory_order_relaxed);
  application->set_readings(readings);
  bool healthy = power->condition() == firmware::Fault::none;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    healthy = healthy && application->fault(axis) == firmware::Fault::none;
  power->hardware().show_healthy(healthy);
  // TIM1 and TIM8 go on while a debugger halts the core (tick_watch.hpp), whatever it may have set.
  stm32::dbgmcu().apb2_fz = 0;
  if (power->drives().all_have_ticked()) watchdog.feed();
}

/// A reset by software: the bridges are off before it, and every pin is what it is at power-on.
[[noreturn]] void restart() {
  cortex::enter_safe_state();
  cortex::reset_core();
}

/// Until the next interrupt. It is taken a few cycles after it has woken the core, by whose counter it is
/// timed. A function of its own: in between nothing is loaded from a stack that an interrupt might find full.
[[gnu::noinline]] void sleep() {
  const auto cycles = [] { return cortex::CycleCounter{cortex::dwt(), cortex::core_debug()}.now(); };
  cortex::mask_interrupts();
  cortex::wait_for_interrupt();
  const std::uint32_t awake = cycles();
  cortex::unmask_interrupts();
  const std::uint32_t taken = cycles() - awake;
  if (taken > longest_tick) [[unlikely]] {
    // With a USB interrupt in it, it was not the tick alone.
    if (!usb_interrupted) longest_tick = taken;
    usb_interrupted = false;
  }
}

/// No encoder is read here, and none is claimed: the axes tick, and refuse to be armed. In the main loop: on
/// a slow clock a tick takes longer than the characters of the serial line, and they would be lost.
void tick_without_power() {
  odrive_v3::tick_without_power(*application);
}

/// All that comes before the loop.
[[gnu::cold]] void start() {
  enter_boot_loader_if_asked(boot_loader_asked);
  // What another program has set up is nowhere expected below.
  if (stm32::begins_behind_a_jump(stm32::rcc()) || !cortex::takes_interrupts()) restart();
  cortex::protect_memory(cortex::mpu(), memory_rights);
  switch_power_stage_off();
  const stm32::ClockFrequencies clocks = stm32::ClockTree{stm32::rcc(), stm32::pwr(), stm32::flash()}.start();
  const VoltageVariant variant = voltage_variant();
  application.emplace(identity(clocks, variant), capture_memory, log_memory);
  application->attach_store(firmware::AnyFlashSectors::of(parameter_flash));

  priority::set_all(interrupts);
  // Each core clock of the clock tree is a whole number of MHz and of periods.
  if (!system_tick.start(clocks.core_hz, clock_rate_hz)) cortex::stop_on_unexpected_interrupt();
  stm32::enable_peripheral_clock(stm32::rcc().apb1enr, stm32::rcc_apb1enr::Usart2::mask);
  apply(serial_pins);
  serial_link.emplace(stm32::usart2(), interrupts, clocks.apb1_hz);
  serial_link->start(application->serial());
  stm32::enable_peripheral_clock(stm32::rcc().apb1enr, stm32::rcc_apb1enr::Can1::mask);
  apply(can_pins);
  // The internal oscillator is off by more than a bus allows (clock_tree.hpp): without the crystal no bit
  // rate can be made.
  const bool good_clock = clocks.source == stm32::ClockSource::crystal_pll;
  can_link.emplace(interrupts, good_clock ? clocks.apb1_hz : 0);
  // Nor 48 MHz as USB wants them.
  stm32::enable_peripheral_clock(stm32::rcc().ahb2enr, stm32::rcc_ahb2enr::OtgFs::mask);
  apply(usb_pins);
  usb_link.emplace(application->usb(), system_tick, usb_identity(serial_number_from_unique_id()),
                   clocks.apb1_hz, boot_loader_is_safe(otp_byte), interrupts);
  if (good_clock) usb_link->start();

  // Ticks, timings and gains are those of 168 MHz. On a slower clock there is no power stage, and the axes
  // say that they have no encoder.
  if (clocks.source != stm32::ClockSource::unresponsive && clocks.core_hz == description.core_clock_hz) {
    power.emplace(supply_divider_ratio(variant), chip_bus);
    if (!start_power(clocks) || !watchdog.start(watchdog_ms)) cortex::stop_on_unexpected_interrupt();
  }
}

/// A host is at the USB connector, or just has been.
[[gnu::cold, gnu::noinline]] void poll_usb() {
  usb_interrupted = false;
  usb_link->poll(*application, *can_link);
  if (!usb_link->boot_loader_wanted(*application)) return;
  usb_link->disconnect();
  boot_loader_asked.set(asks_for_boot_loader);
  restart();
}

void poll() {
  const std::uint32_t now = system_tick.now_us();
  can_link->poll(application->can(), now);
  application->poll(now);
  if (usb_link->due()) [[unlikely]]
    poll_usb();
  can_link->send(application->can());
  serial_link->poll(application->serial(), now);
  if (application->can().restart_wanted()) restart();
  if (power_runs) poll_power(now);
}

/// Hot, for what runs once, and what never returns, is made small instead of fast.
[[noreturn, gnu::noinline, gnu::hot]] void run() {
  while (!power_runs) {
    tick_without_power();
    poll();
    if (!links_due.take()) sleep();
  }
  for (;;) {
    bool due = links_due.take();
    due = power->drives().main_loop_due() || due;
    // What has come meanwhile does not wait; what comes between the look above and the sleep does, for the
    // next interrupt, at most half a tick, and in the loop without ticks a millisecond.
    if (due) {
      poll();
    } else {
      sleep();
    }
  }
}

void ISR_receive_can(unsigned fifo) {
  can_link->ISR_receive(fifo, application->can(),
                        [](const drivers::CanFrame& frame) { usb_link->ISR_bus_frame(frame); });
  links_due.ISR_raise();
}

}  // namespace

}  // namespace kmax::board

void kmax::drivers::cortex_m::enter_safe_state() {
  using namespace kmax::board;
  // MOE first: one store for each bridge, if its timer has a clock.
  constexpr std::uint32_t bridges = stm32::rcc_apb2enr::Timer1::mask | stm32::rcc_apb2enr::Timer8::mask;
  if ((static_cast<std::uint32_t>(stm32::rcc().apb2enr) & bridges) == bridges) {
    stm32::tim1().bdtr = 0;
    stm32::tim8().bdtr = 0;
  }
  // The pins' latches first, then the direction, in case the pins were not set up yet.
  switch_power_stage_off();
}

void ISR_adc() {
  using namespace kmax::board;
  odrive_v3::ISR_tick(*power, application->ISR_axes());
}

void ISR_exti2() {
  using namespace kmax::board;
  static_cast<void>(line_interrupts.ISR_take(odrive_v3::pins::gate_driver_fault.number));
  power->ISR_fault_line();
}

void ISR_exti4() {
  using namespace kmax::board;
  static_cast<void>(line_interrupts.ISR_take(odrive_v3::pins::emergency_stop.number));
  power->ISR_emergency_stop();
}

void ISR_system_tick() {
  using namespace kmax;
  board::system_tick.ISR_count();
  // Not before the first ticks: the power stage takes longer to become ready than this takes to settle.
  if (board::power_runs && board::power->ready() && board::power->drives().ISR_ticks_have_stopped())
    board::ticks_have_stopped.store(true, std::memory_order_relaxed);
}

void ISR_can1_tx() {
  kmax::board::can_link->ISR_serve_transmit();
  kmax::board::links_due.ISR_raise();
}

void ISR_can1_rx0() {
  kmax::board::ISR_receive_can(0);
}

void ISR_can1_rx1() {
  kmax::board::ISR_receive_can(1);
}

void ISR_can1_sce() {
  kmax::board::can_link->ISR_serve_status();
}

void ISR_otg_fs() {
  using namespace kmax::board;
  usb_interrupted = true;
  if (usb_link->ISR_serve()) links_due.ISR_raise();
}

void ISR_usart2() {
  using namespace kmax::board;
  if (serial_link->ISR_serve(application->serial(), system_tick)) links_due.ISR_raise();
}

int main() {
  kmax::board::start();
  kmax::board::run();
}
