#include "host_tools/virtual_board/stm32f4/stm32f405.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/adc.hpp"
#include "drivers/stm32f4/registers/can.hpp"
#include "drivers/stm32f4/registers/otg_fs.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/spi.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace chip = drivers::stm32f4;
using chip::GpioPort;
using chip::ResetCause;

Peripherals::Peripherals(BoardClocks& clocks, Bus& bus, CorePeripherals& core, const Surroundings& around)
    : flash(clocks, bus.flash()),
      pwr(clocks),
      rcc(clocks, flash, pwr),
      ports{GpioPortModel{GpioPort::a}, GpioPortModel{GpioPort::b}, GpioPortModel{GpioPort::c},
            GpioPortModel{GpioPort::d}},
      exti(syscfg, core.nvic),
      advanced_timers{AdvancedTimerModel{AdvancedTimer::tim1, clocks},
                      AdvancedTimerModel{AdvancedTimer::tim8, clocks}},
      general_timers{GeneralTimerModel{GeneralTimer::tim3, clocks},
                     GeneralTimerModel{GeneralTimer::tim4, clocks}},
      one_pulse_timer(clocks),
      dma2(bus),
      adc(clocks, core.nvic, around.analogue),
      usart2(clocks, core.nvic, chip::Interrupt::usart2),
      uart4(clocks, core.nvic, chip::Interrupt::uart4),
      can1(clocks, core.nvic, around.can_bus),
      otg_fs(
          clocks, core.nvic, around.usb_port, [this](BoardTime at) { return rcc.usb_clock(at); },
          [this] { return has_usb_pins(ports[0]); }),
      spi3(clocks) {}

Stm32f405::Stm32f405(const base::ElfImage& image, const Stm32f405Config& config, Surroundings around)
    : image_(image),
      around_(std::move(around)),
      core_(bus_, clocks_, chip::interrupt_count),
      processor_(bus_, core_, clocks_, config.processor),
      events_(processor_),
      frozen_outputs_(config.frozen_outputs) {
  for (const base::ElfSegment& segment : image_.segments()) {
    const auto memory = bus_.memory(segment.address, segment.bytes.size());
    if (memory.empty() || !memory_map::flash.contains(segment.address)) {
      throw std::runtime_error(
          fmt::format("the image has {} bytes at 0x{:08X}, where this board has no flash memory",
                      segment.bytes.size(), segment.address));
    }
    std::copy(segment.bytes.begin(), segment.bytes.end(), memory.begin());
  }
  processor_.name_functions_by([this](std::uint32_t address) { return image_.function_at(address); });
  attach_peripherals(config);
  connect_peripherals();
}

void Stm32f405::attach_peripherals(const Stm32f405Config& config) {
  Peripherals& p = peripherals_;
  constexpr std::size_t always = 0;
  constexpr std::size_t ahb1 = offsetof(chip::RccRegisters, ahb1enr);
  constexpr std::size_t apb1 = offsetof(chip::RccRegisters, apb1enr);
  constexpr std::size_t apb2 = offsetof(chip::RccRegisters, apb2enr);
  // The loop asks those with events at every event. At one instant it serves them in the order of this list:
  // an update event comes before the conversions that it starts.
  const auto attach = [this, &p](bool has_events, std::uint32_t base, std::uint32_t size, std::string name,
                                 Peripheral& block, std::size_t enable_register, std::uint32_t enable_mask) {
    std::function<bool()> clocked;
    if (enable_register != always) {
      clocked = [&rcc = p.rcc, enable_register, enable_mask] {
        return rcc.clock_enabled(enable_register, enable_mask);
      };
    }
    bus_.attach(base, size, std::move(name), block, std::move(clocked));
    resettable_.push_back(&block);
    if (has_events) events_.add(block);
  };
  const auto other = [this](auto model) -> Peripheral& { return *others_.emplace_back(std::move(model)); };
  constexpr bool with_events = true, without_events = false;
  constexpr std::uint32_t timer_size = sizeof(chip::TimerRegisters);
  constexpr std::uint32_t all_adcs =
      chip::rcc_apb2enr::Adc1::mask | chip::rcc_apb2enr::Adc2::mask | chip::rcc_apb2enr::Adc3::mask;
  attach(with_events, chip::tim1_base, timer_size, "TIM1", p.advanced_timers[0], apb2,
         chip::rcc_apb2enr::Timer1::mask);
  attach(with_events, chip::tim8_base, timer_size, "TIM8", p.advanced_timers[1], apb2,
         chip::rcc_apb2enr::Timer8::mask);
  attach(with_events, chip::adc_base, 0x400, "ADC", p.adc, apb2, all_adcs);
  attach(with_events, chip::usart2_base, UsartModel::size, "USART2", p.usart2, apb1,
         chip::rcc_apb1enr::Usart2::mask);
  attach(with_events, chip::uart4_base, UsartModel::size, "UART4", p.uart4, apb1,
         chip::rcc_apb1enr::Uart4::mask);
  attach(with_events, chip::spi3_base, sizeof(chip::SpiRegisters), "SPI3", p.spi3, apb1,
         chip::rcc_apb1enr::Spi3::mask);
  attach(with_events, chip::tim2_base, timer_size, "TIM2", p.one_pulse_timer, apb1,
         chip::rcc_apb1enr::Timer2::mask);
  attach(with_events, chip::dma2_base, DmaModel::size, "DMA2", p.dma2, ahb1, chip::rcc_ahb1enr::Dma2::mask);
  attach(with_events, chip::rcc_base, RccModel::size, "RCC", p.rcc, always, 0);
  attach(with_events, chip::iwdg_base, IwdgModel::size, "IWDG", p.iwdg, always, 0);
  attach(with_events, chip::can1_base, 0x400, "CAN1", p.can1, apb1, chip::rcc_apb1enr::Can1::mask);
  attach(with_events, chip::otg_fs_base, OtgFsModel::size, "OTG_FS", p.otg_fs,
         offsetof(chip::RccRegisters, ahb2enr), chip::rcc_ahb2enr::OtgFs::mask);
  attach(without_events, chip::tim3_base, timer_size, "TIM3", p.general_timers[0], apb1,
         chip::rcc_apb1enr::Timer3::mask);
  attach(without_events, chip::tim4_base, timer_size, "TIM4", p.general_timers[1], apb1,
         chip::rcc_apb1enr::Timer4::mask);
  constexpr std::uint32_t port_clocks[] = {chip::rcc_ahb1enr::GpioA::mask, chip::rcc_ahb1enr::GpioB::mask,
                                           chip::rcc_ahb1enr::GpioC::mask, chip::rcc_ahb1enr::GpioD::mask};
  for (std::size_t i = 0; i < p.ports.size(); ++i) {
    attach(without_events, chip::gpio_base(static_cast<GpioPort>(i)), 0x400, fmt::format("GPIO{}", "ABCD"[i]),
           p.ports[i], ahb1, port_clocks[i]);
  }
  attach(without_events, chip::syscfg_base, 0x400, "SYSCFG", p.syscfg, apb2,
         chip::rcc_apb2enr::SystemConfiguration::mask);
  attach(without_events, chip::exti_base, 0x400, "EXTI", p.exti, always, 0);
  attach(without_events, chip::pwr_base, PwrModel::size, "PWR", p.pwr, apb1, chip::rcc_apb1enr::Power::mask);
  attach(without_events, chip::flash_interface_base, FlashInterface::size, "FLASH", p.flash, always, 0);
  attach(without_events, chip::dbgmcu_base, DbgmcuModel::size, "DBGMCU", p.dbgmcu, always, 0);
  attach(without_events, drivers::cortex_m::dwt_base, DwtModel::size, "DWT",
         other(std::make_unique<DwtModel>([this] { return processor_.cycles(); },
                                          [this] { return core_.core_debug.trace_enabled(); })),
         always, 0);
  attach(without_events, DeviceIdentity::base, DeviceIdentity::size, "system memory",
         other(std::make_unique<DeviceIdentity>(config.identity)), always, 0);
  p.iwdg.set_oscillator_hz(config.watchdog_oscillator_hz);
  p.flash.set_brown_out_level(config.brown_out_level);
  for (AdvancedTimerModel& timer : p.advanced_timers) timer.set_break_input(config.break_inputs_high, now());
  events_.add(core_.system_tick);
  events_.add(flash_stall_);
}

void Stm32f405::connect_peripherals() {
  Peripherals& p = peripherals_;
  auto& [tim1, tim8] = p.advanced_timers;
  p.syscfg.on_memory_at_zero([this](bool sram) { bus_.show_sram_at_zero(sram); });
  bus_.on_parameter_store([this](std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now) {
    peripherals_.flash.store(address, bytes, value, now);
  });
  tim1.on_trigger_output([this](BoardTime now) {
    peripherals_.advanced_timers[1].trigger_input(now);
    around_.before_conversions(now);
    look_at_supply();
    peripherals_.adc.trigger_injected(now);
  });
  // RM0090, table DMA2 request mapping; TIM1's update has a request that nobody uses.
  tim1.on_dma_request([this](TimerRequest request, BoardTime now) {
    if (request == TimerRequest::compare_4) peripherals_.dma2.request(chip::dma2_tim1_compare_4, now);
  });
  tim8.on_dma_request([this](TimerRequest request, BoardTime now) {
    peripherals_.dma2.request(
        request == TimerRequest::update ? chip::dma2_tim8_update : chip::dma2_tim8_compare_4, now);
  });
  p.rcc.on_clock_failure([this](BoardTime now) {
    for (auto& timer : peripherals_.advanced_timers) timer.clock_failure_break(now);
  });
  p.rcc.on_peripheral_reset([this](std::uint32_t bits, BoardTime now) {
    if ((bits & chip::rcc_apb2enr::Timer1::mask) != 0) peripherals_.advanced_timers[0].reset(now);
    if ((bits & chip::rcc_apb2enr::Timer8::mask) != 0) peripherals_.advanced_timers[1].reset(now);
  });
  p.rcc.on_usb_reset([this](BoardTime now) { peripherals_.otg_fs.reset(now); });
  p.rcc.on_clock_security_interrupt([this](bool level, BoardTime /*now*/) {
    if (level) core_.exceptions.pend(exception_number::non_maskable);
  });
  p.iwdg.on_started([this](BoardTime /*now*/) { peripherals_.rcc.note_low_speed_oscillator_running(); });
  p.iwdg.on_reset([this](BoardTime /*now*/) {
    watchdog_fired_ = true;
    processor_.stop();
  });
  for (std::size_t i = 0; i < p.ports.size(); ++i) {
    p.ports[i].on_input_change([this, i](unsigned pin, bool level, BoardTime now) {
      peripherals_.exti.set_pin(static_cast<GpioPort>(i), pin, level, now);
    });
  }
}

void Stm32f405::halt() {
  halted_ = true;
  core_.system_tick.halt(now());
  set_frozen(true);
}

void Stm32f405::resume() {
  halted_ = false;
  core_.system_tick.resume(now());
  set_frozen(false);
}

// TIM3, TIM4 count edges and CAN1 goes on whatever their bits say.
void Stm32f405::set_frozen(bool halted) {
  constexpr std::array<std::uint32_t, 2> bits{chip::dbgmcu_apb2_fz::Timer1::mask,
                                              chip::dbgmcu_apb2_fz::Timer8::mask};
  for (std::size_t axis = 0; axis < peripherals_.advanced_timers.size(); ++axis)
    peripherals_.advanced_timers[axis].freeze(halted && peripherals_.dbgmcu.freezes_on_apb2(bits[axis]),
                                              frozen_outputs_, now());
  peripherals_.iwdg.freeze(
      halted && peripherals_.dbgmcu.freezes_on_apb1(chip::dbgmcu_apb1_fz::IndependentWatchdog::mask), now());
}

// STM32F405 data sheet, BOR thresholds (falling, typical, RM0090: 2.7, 2.4 and 2.1 V) and power-on reset;
// RM0090, flash: 168 MHz needs 2.7 V.
void Stm32f405::look_at_supply() {
  constexpr std::array<double, 4> thresholds{2.7, 2.4, 2.1, 1.8};
  constexpr double least_at_full_speed = 2.7;
  const double volts = around_.supply();
  if (volts < thresholds[peripherals_.flash.brown_out_level()]) {
    browned_out_ = true;
    if (!halted_) processor_.stop();
  } else if (volts < least_at_full_speed) {
    throw std::runtime_error(fmt::format(
        "at {:.6f} s: the processor runs at {} MHz with {} wait states from {:.2f} V; it needs "
        "2.7 V, and its brown-out level lets it run from {:.1f} V on",
        seconds(now()), units_per_second / clocks_.core / 1'000'000, peripherals_.flash.wait_states(), volts,
        thresholds[peripherals_.flash.brown_out_level()]));
  }
}

// Held in reset until the supply is back.
void Stm32f405::sit_brown_out_out(BoardTime time) {
  constexpr double released = 2.8;
  reset(ResetCause::brown_out);
  while (now() < time && around_.supply() < released) {
    processor_.stall_until(std::min(time, now() + 100 * units_per_microsecond));
    around_.time_passes(now());
  }
  browned_out_ = around_.supply() < released;
  // The first instruction of the program that starts now.
  if (!browned_out_) reset(ResetCause::brown_out);
}

void Stm32f405::reset(ResetCause cause) {
  const BoardTime at = now();
  for (Peripheral* peripheral : resettable_) peripheral->reset(at);
  peripherals_.rcc.note_reset(cause);
  processor_.reset(at);
  watchdog_fired_ = halted_ = false;
  ++resets_;
}

void Stm32f405::run_until(BoardTime time) {
  while (now() < time && !peripherals_.flash.power_is_cut()) {
    if (browned_out_) {
      sit_brown_out_out(time);
      continue;
    }
    if (halted_) {
      stand_still_until(time);
      continue;
    }
    const RunEnd end = events_.run_until(time);
    if (flash_stall_.take()) {
      stand_still_until(peripherals_.flash.busy_until());
      continue;
    }
    if (watchdog_fired_) {
      reset(ResetCause::independent_watchdog);
    } else if (end == RunEnd::reset_requested) {
      reset(ResetCause::software);
    } else if (end == RunEnd::fault) {
      // Cut in the middle of an erase or a store: nothing runs any more.
      if (peripherals_.flash.power_is_cut()) return;
      fail();
    } else if (end == RunEnd::stopped) {
      if (browned_out_) continue;
      return;
    }
  }
}

// The one bank is busy and the core gets no instruction, or it is halted. Everything else goes on.
void Stm32f405::stand_still_until(BoardTime time) {
  while (now() < time && !watchdog_fired_) {
    const BoardTime next = std::min(time, std::max(events_.next_event(), now()));
    processor_.stall_until(next);
    events_.catch_up(next);
  }
  if (watchdog_fired_) reset(ResetCause::independent_watchdog);
}

std::string Stm32f405::where() const {
  const std::uint32_t address = processor_.program_counter();
  return fmt::format("{} in {} (0x{:08X})", processor_.sleeping() ? "sleeping" : "running",
                     image_.function_at(address), address);
}

void Stm32f405::fail() const {
  throw std::runtime_error(fmt::format("at {:.6f} s: {}", seconds(processor_.now()), processor_.fault()));
}

void Stm32f405::cycle_power() {
  peripherals_.flash.power_up(now());
  for (const auto memory : {bus_.sram(), bus_.ccm()}) {
    for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = static_cast<std::uint8_t>(0xA5U ^ (i * 7U));
  }
  reset(ResetCause::power_on);
}

}  // namespace kmax::virtual_board
