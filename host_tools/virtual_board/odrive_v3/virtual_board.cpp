#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <stdexcept>

#include "board/odrive_v3/pins.hpp"
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
namespace pins = board::odrive_v3::pins;
using chip::GpioPort;
using chip::ResetCause;

VirtualBoard::VirtualBoard(const base::ElfImage& image, BoardWorld* world, const VirtualBoardConfig& config)
    : image_(image),
      world_(world),
      core_(bus_, clocks_, drivers::stm32f4::interrupt_count),
      processor_(bus_, core_, clocks_, config.processor),
      events_(processor_),
      brake_(config.bootstrap),
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
  wire();
  if (world_ != nullptr) {
    spikes_.configure(world_->spikes());
    if (!world_->select_filtered()) serial_encoder_.set_select_timing({.filter = 0.0});
  }
  reset(ResetCause::power_on);
  set_board_resistors();
}

void VirtualBoard::attach_peripherals(const VirtualBoardConfig& config) {
  constexpr std::size_t always = 0;
  constexpr std::size_t ahb1 = offsetof(chip::RccRegisters, ahb1enr);
  constexpr std::size_t apb1 = offsetof(chip::RccRegisters, apb1enr);
  constexpr std::size_t apb2 = offsetof(chip::RccRegisters, apb2enr);
  // The loop asks those with events at every event. At one instant it serves them in the order of this list:
  // an update event comes before the conversions that it starts.
  const auto attach = [this](bool has_events, std::uint32_t base, std::uint32_t size, std::string name,
                             Peripheral& block, std::size_t enable_register, std::uint32_t enable_mask) {
    std::function<bool()> clocked;
    if (enable_register != always) {
      clocked = [this, enable_register, enable_mask] {
        return rcc_.clock_enabled(enable_register, enable_mask);
      };
    }
    bus_.attach(base, size, std::move(name), block, std::move(clocked));
    peripherals_.push_back(&block);
    if (has_events) events_.add(block);
  };
  const auto other = [this](auto model) -> Peripheral& { return *others_.emplace_back(std::move(model)); };
  constexpr bool with_events = true, without_events = false;
  constexpr std::uint32_t timer_size = sizeof(chip::TimerRegisters);
  constexpr std::uint32_t all_adcs =
      chip::rcc_apb2enr::Adc1::mask | chip::rcc_apb2enr::Adc2::mask | chip::rcc_apb2enr::Adc3::mask;
  attach(with_events, chip::tim1_base, timer_size, "TIM1", pwm_[0], apb2, chip::rcc_apb2enr::Timer1::mask);
  attach(with_events, chip::tim8_base, timer_size, "TIM8", pwm_[1], apb2, chip::rcc_apb2enr::Timer8::mask);
  attach(with_events, chip::adc_base, 0x400, "ADC", adc_, apb2, all_adcs);
  attach(with_events, chip::usart2_base, UsartModel::size, "USART2", usart2_, apb1,
         chip::rcc_apb1enr::Usart2::mask);
  attach(with_events, chip::uart4_base, UsartModel::size, "UART4", uart4_, apb1,
         chip::rcc_apb1enr::Uart4::mask);
  attach(with_events, chip::spi3_base, sizeof(chip::SpiRegisters), "SPI3", spi3_, apb1,
         chip::rcc_apb1enr::Spi3::mask);
  attach(with_events, chip::tim2_base, timer_size, "TIM2", brake_timer_, apb1,
         chip::rcc_apb1enr::Timer2::mask);
  attach(with_events, chip::dma2_base, DmaModel::size, "DMA2", dma2_, ahb1, chip::rcc_ahb1enr::Dma2::mask);
  attach(with_events, chip::rcc_base, RccModel::size, "RCC", rcc_, always, 0);
  attach(with_events, chip::iwdg_base, IwdgModel::size, "IWDG", iwdg_, always, 0);
  attach(with_events, chip::can1_base, 0x400, "CAN1", can1_, apb1, chip::rcc_apb1enr::Can1::mask);
  attach(with_events, chip::otg_fs_base, OtgFsModel::size, "OTG_FS", otg_fs_,
         offsetof(chip::RccRegisters, ahb2enr), chip::rcc_ahb2enr::OtgFs::mask);
  attach(without_events, chip::tim3_base, timer_size, "TIM3", encoders_[0], apb1,
         chip::rcc_apb1enr::Timer3::mask);
  attach(without_events, chip::tim4_base, timer_size, "TIM4", encoders_[1], apb1,
         chip::rcc_apb1enr::Timer4::mask);
  constexpr std::uint32_t port_clocks[] = {chip::rcc_ahb1enr::GpioA::mask, chip::rcc_ahb1enr::GpioB::mask,
                                           chip::rcc_ahb1enr::GpioC::mask, chip::rcc_ahb1enr::GpioD::mask};
  for (std::size_t i = 0; i < ports_.size(); ++i) {
    attach(without_events, chip::gpio_base(static_cast<GpioPort>(i)), 0x400, fmt::format("GPIO{}", "ABCD"[i]),
           ports_[i], ahb1, port_clocks[i]);
  }
  attach(without_events, chip::syscfg_base, 0x400, "SYSCFG", syscfg_, apb2,
         chip::rcc_apb2enr::SystemConfiguration::mask);
  attach(without_events, chip::exti_base, 0x400, "EXTI", exti_, always, 0);
  attach(without_events, chip::pwr_base, PwrModel::size, "PWR", pwr_, apb1, chip::rcc_apb1enr::Power::mask);
  attach(without_events, chip::flash_interface_base, FlashInterface::size, "FLASH", flash_, always, 0);
  attach(without_events, chip::dbgmcu_base, DbgmcuModel::size, "DBGMCU", dbgmcu_, always, 0);
  attach(without_events, drivers::cortex_m::dwt_base, DwtModel::size, "DWT",
         other(std::make_unique<DwtModel>([this] { return processor_.cycles(); },
                                          [this] { return core_.core_debug.trace_enabled(); })),
         always, 0);
  attach(without_events, DeviceIdentity::base, DeviceIdentity::size, "system memory",
         other(std::make_unique<DeviceIdentity>(config.identity)), always, 0);
  iwdg_.set_oscillator_hz(config.watchdog_oscillator_hz);
  flash_.set_brown_out_level(config.brown_out_level);
  for (AdvancedTimerModel& timer : pwm_) timer.set_break_input(config.break_inputs_high, now());
  events_.add(core_.system_tick);
  events_.add(chip_events_);
  events_.add(flash_stall_);
}

void VirtualBoard::wire() {
  syscfg_.on_memory_at_zero([this](bool sram) { bus_.show_sram_at_zero(sram); });
  bus_.on_parameter_store([this](std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now) {
    flash_.store(address, bytes, value, now);
  });
  pwm_[0].on_trigger_output([this](BoardTime now) {
    pwm_[1].trigger_input(now);
    if (world_ != nullptr) world_->set_low_sides(pwm_[0].counting_down() ? 1 : 0);
    look_at_world(now);
    adc_.trigger_injected(now);
  });
  for (std::size_t axis = 0; axis < pwm_.size(); ++axis) {
    pwm_[axis].on_output_change([this, axis](BoardTime now) { show_bridge(axis, now); });
  }
  // RM0090, table DMA2 request mapping; TIM1's update has a request that nobody uses.
  pwm_[0].on_dma_request([this](TimerRequest request, BoardTime now) {
    if (request == TimerRequest::compare_4) dma2_.request(chip::dma2_tim1_compare_4, now);
  });
  pwm_[1].on_dma_request([this](TimerRequest request, BoardTime now) {
    dma2_.request(request == TimerRequest::update ? chip::dma2_tim8_update : chip::dma2_tim8_compare_4, now);
  });
  brake_timer_.on_output_change([this](BoardTime now) { show_brake(now); });
  chip_events_.on_brake_change([this](BoardTime now) {
    if (world_ != nullptr) world_->set_brake(brake_.on(), now);
  });
  spikes_.on_change([this](LineSpikes::Line line, BoardTime now) { show_spike(line, now); });
  rcc_.on_clock_failure([this](BoardTime now) {
    for (auto& timer : pwm_) timer.clock_failure_break(now);
  });
  rcc_.on_peripheral_reset([this](std::uint32_t bits, BoardTime now) {
    if ((bits & chip::rcc_apb2enr::Timer1::mask) != 0) pwm_[0].reset(now);
    if ((bits & chip::rcc_apb2enr::Timer8::mask) != 0) pwm_[1].reset(now);
  });
  rcc_.on_usb_reset([this](BoardTime now) { otg_fs_.reset(now); });
  rcc_.on_clock_security_interrupt([this](bool level, BoardTime /*now*/) {
    if (level) core_.exceptions.pend(exception_number::non_maskable);
  });
  iwdg_.on_started([this](BoardTime /*now*/) { rcc_.note_low_speed_oscillator_running(); });
  iwdg_.on_reset([this](BoardTime /*now*/) {
    watchdog_fired_ = true;
    processor_.stop();
  });
  usart2_.on_transmitted([this](std::uint8_t byte, BoardTime /*end*/) { transmitted_.push_back(byte); });
  wire_chips();
  wire_pins();
}

void VirtualBoard::wire_chips() {
  spi3_.on_frame([this](std::uint16_t word, BoardTime now) { return exchange(word, now); });
  for (Drv8301Chip& driver : gate_drivers_) {
    driver.on_fault_output([this](bool /*level*/, BoardTime now) {
      show_fault_line(now);
      for (std::size_t axis = 0; axis < pwm_.size(); ++axis) show_bridge(axis, now);
    });
  }
}

// All chips share the wire; those that drive it are anded, and nobody at all is the pull-up.
std::uint16_t VirtualBoard::exchange(std::uint16_t word, BoardTime now) {
  std::uint16_t wire = 0xFFFF;
  for (Drv8301Chip& driver : gate_drivers_) wire &= driver.exchange(word, now).value_or(0xFFFF);
  if (world_ != nullptr) serial_encoder_.set_fitted(world_->serial_encoder(now).fitted);
  wire &= serial_encoder_.exchange(word, now, spi3_.frame_began()).value_or(0xFFFF);
  for (std::size_t axis = 0; axis < gate_drivers_.size() && world_ != nullptr; ++axis) {
    world_->set_amplifiers(axis, drivers::gain_factor(gate_drivers_[axis].gain()),
                           gate_drivers_[axis].calibrating(), now);
  }
  return wire;
}

// Gate signals reach the FETs through a driver that is awake and without a latched fault.
void VirtualBoard::show_bridge(std::size_t axis, BoardTime now) {
  if (world_ == nullptr) return;
  std::array<PwmLegOutput, 3> legs = pwm_[axis].outputs();
  if (!gate_drivers_[axis].drives_gates(now)) {
    for (PwmLegOutput& leg : legs) leg.enabled = false;
  }
  world_->set_bridge(axis, legs, now);
}

// The pin is the port's or TIM2's. The driver has its supply from the gate drivers.
void VirtualBoard::show_brake(BoardTime now) {
  const GpioPortModel& port = ports_[static_cast<std::size_t>(pins::brake_high_side.port)];
  const bool of_timer = port.mode(pins::brake_high_side.number) == chip::GpioMode::alternate;
  const bool high =
      of_timer ? brake_timer_.output() : port.output(pins::brake_high_side.number) == PinOutput::high;
  const bool before = brake_.on();
  brake_.drive(high, gate_drivers_[0].answers(now), now);
  if (world_ != nullptr && brake_.on() != before) world_->set_brake(brake_.on(), now);
}

bool VirtualBoard::gates_active(std::size_t axis) const {
  return gate_drivers_[axis].drives_gates(now()) &&
         std::ranges::any_of(pwm_[axis].outputs(), &PwmLegOutput::enabled);
}

void VirtualBoard::halt() {
  halted_ = true;
  core_.system_tick.halt(now());
  set_frozen(true, now());
}

void VirtualBoard::resume() {
  halted_ = false;
  core_.system_tick.resume(now());
  set_frozen(false, now());
}

// TIM3, TIM4 count edges and CAN1 goes on whatever their bits say.
void VirtualBoard::set_frozen(bool halted, BoardTime now) {
  constexpr std::array<std::uint32_t, 2> bits{chip::dbgmcu_apb2_fz::Timer1::mask,
                                              chip::dbgmcu_apb2_fz::Timer8::mask};
  for (std::size_t axis = 0; axis < pwm_.size(); ++axis)
    pwm_[axis].freeze(halted && dbgmcu_.freezes_on_apb2(bits[axis]), frozen_outputs_, now);
  iwdg_.freeze(halted && dbgmcu_.freezes_on_apb1(chip::dbgmcu_apb1_fz::IndependentWatchdog::mask), now);
}

void VirtualBoard::show_fault_line(BoardTime now) {
  const bool low = fault_line_held_ || spikes_.on(LineSpikes::fault_line) ||
                   !gate_drivers_[0].fault_output() || !gate_drivers_[1].fault_output();
  port(pins::gate_driver_fault.port)
      .drive(pins::gate_driver_fault.number, low ? PinDrive::low : PinDrive::floating, now);
}

void VirtualBoard::wire_pins() {
  for (std::size_t i = 0; i < ports_.size(); ++i) {
    const auto port_id = static_cast<GpioPort>(i);
    ports_[i].on_input_change([this, port_id](unsigned pin, bool level, BoardTime now) {
      exti_.set_pin(port_id, pin, level, now);
    });
  }
  for (std::size_t i = 0; i < ports_.size(); ++i) {
    const auto port_id = static_cast<GpioPort>(i);
    ports_[i].on_output_change([this, port_id](unsigned number, PinOutput output, BoardTime now) {
      const board::odrive_v3::PinLocation pin{port_id, static_cast<std::uint8_t>(number)};
      const bool high = output == PinOutput::high;
      if (pin == pins::gate_enable) {
        for (std::size_t axis = 0; axis < pwm_.size(); ++axis) {
          const bool starts = world_ == nullptr || world_->gate_driver_starts(axis, now);
          gate_drivers_[axis].enable_gate(high, now, starts);
        }
        for (std::size_t axis = 0; axis < pwm_.size(); ++axis) show_bridge(axis, now);
      }
      if (pin == pins::brake_high_side || pin == pins::gate_enable) show_brake(now);
      if (pin == pins::gate_driver0_select) gate_drivers_[0].select(output != PinOutput::low, now);
      if (pin == pins::gate_driver1_select) gate_drivers_[1].select(output != PinOutput::low, now);
      if (pin == pins::encoder_select) serial_encoder_.select(output != PinOutput::low, now);
    });
  }
}

void VirtualBoard::set_board_resistors() {
  const auto drive = [this](board::odrive_v3::PinLocation pin, PinDrive how) {
    port(pin.port).drive(pin.number, how, now());
  };
  for (const auto pin : {pins::brake_low_side, pins::brake_high_side}) drive(pin, PinDrive::pulled_down);
  for (const auto pin : {pins::encoder0_a, pins::encoder0_b, pins::encoder1_a, pins::encoder1_b})
    drive(pin, PinDrive::pulled_up);
  for (const auto pin : {pins::encoder0_index, pins::encoder1_index}) drive(pin, PinDrive::low);
  drive(pins::healthy, PinDrive::pulled_down);
  drive(pins::emergency_stop, PinDrive::low);
}

// At each trigger, which is when the firmware is about to look.
void VirtualBoard::look_at_world(BoardTime now) {
  if (world_ == nullptr) return;
  for (std::size_t axis = 0; axis < encoders_.size(); ++axis) {
    const EncoderSignals signals = world_->encoder(axis, now);
    encoders_[axis].set_encoder_count(signals.edges + false_edges_[axis]);
    gate_drivers_[axis].set_fitted(world_->has_gate_driver(axis));
    index_[axis] = signals.index;
    show_index(axis, now);
  }
  draw_spikes(now);
  look_at_logic_supply();
  // DRV8301 data sheet, protection: PVDD under-voltage at 5.9 V.
  constexpr double lowest_supply = 5.9;
  const bool too_low = world_->supply_voltage() < lowest_supply;
  if (too_low == supply_was_low_) return;
  supply_was_low_ = too_low;
  for (Drv8301Chip& driver : gate_drivers_)
    driver.set_condition(drivers::Drv8301Fault::supply_under_voltage, too_low, now);
}

void VirtualBoard::show_index(std::size_t axis, BoardTime now) {
  const auto pin = axis == 0 ? pins::encoder0_index : pins::encoder1_index;
  const bool level = index_[axis] || spikes_.on(axis == 0 ? LineSpikes::index_0 : LineSpikes::index_1);
  if (port(pin.port).level(pin.number) != level)
    port(pin.port).drive(pin.number, level ? PinDrive::high : PinDrive::low, now);
}

void VirtualBoard::show_emergency_stop(BoardTime now) {
  const bool open = emergency_stop_open_ || spikes_.on(LineSpikes::emergency_stop);
  port(pins::emergency_stop.port)
      .drive(pins::emergency_stop.number, open ? PinDrive::floating : PinDrive::low, now);
}

void VirtualBoard::show_spike(LineSpikes::Line line, BoardTime now) {
  switch (line) {
    case LineSpikes::index_0:
    case LineSpikes::index_1:
      return show_index(line == LineSpikes::index_0 ? 0 : 1, now);
    case LineSpikes::emergency_stop:
      return show_emergency_stop(now);
    case LineSpikes::fault_line:
      return show_fault_line(now);
    case LineSpikes::encoder_0:
    case LineSpikes::encoder_1: {
      // Both lines rise and fall one after the other.
      const std::size_t axis = line == LineSpikes::encoder_0 ? 0 : 1;
      if (spikes_.on(line) && world_->spikes()->width > encoders_[axis].input_filter())
        false_edges_[axis] += 4;
      return;
    }
    case LineSpikes::line_count:
      return;
  }
}

// The edges of a leg are (1 - duty) and (1 + duty) half periods after its axis' conversion, and the other
// axis' conversion is one half period later.
void VirtualBoard::draw_spikes(BoardTime now) {
  if (!pwm_[0].moe() && !pwm_[1].moe()) return;
  spikes_.draw(now, [this](double choice) {
    constexpr double half_period = 25e-6;
    const auto which = static_cast<std::size_t>(choice * 12.0);
    const double duty = pwm_[which % 2].outputs()[which / 2 % 3].high_duty;
    return half_period * (which < 6 ? duty : 1.0 - duty);
  });
}

/// Volts, behind the gate driver's buck converter and a linear regulator; what they lose when the supply gets
/// low is a guess.
double VirtualBoard::logic_supply() const {
  constexpr double nominal = 3.3, lost = 1.2;
  return world_ == nullptr ? nominal : std::clamp(world_->supply_voltage() - lost, 0.0, nominal);
}

// STM32F405 data sheet, BOR thresholds (falling, typical, RM0090: 2.7, 2.4 and 2.1 V) and power-on reset;
// RM0090, flash: 168 MHz needs 2.7 V.
void VirtualBoard::look_at_logic_supply() {
  constexpr std::array<double, 4> thresholds{2.7, 2.4, 2.1, 1.8};
  constexpr double least_at_full_speed = 2.7;
  const double volts = logic_supply();
  if (volts < thresholds[flash_.brown_out_level()]) {
    browned_out_ = true;
    if (!halted_) processor_.stop();
  } else if (volts < least_at_full_speed) {
    throw std::runtime_error(
        fmt::format("at {:.6f} s: the processor runs at {} MHz with {} wait states from {:.2f} V; it needs "
                    "2.7 V, and its brown-out level lets it run from {:.1f} V on",
                    seconds(now()), units_per_second / clocks_.core / 1'000'000, flash_.wait_states(), volts,
                    thresholds[flash_.brown_out_level()]));
  }
}

// Held in reset until the supply is back.
void VirtualBoard::sit_brown_out_out(BoardTime time) {
  constexpr double released = 2.8;
  reset(ResetCause::brown_out);
  while (now() < time && logic_supply() < released) {
    processor_.stall_until(std::min(time, now() + 100 * units_per_microsecond));
    static_cast<void>(world_->encoder(0, now()));
  }
  browned_out_ = logic_supply() < released;
  // The first instruction of the program that starts now.
  if (!browned_out_) reset(ResetCause::brown_out);
}

void VirtualBoard::reset(ResetCause cause) {
  const BoardTime at = now();
  for (Peripheral* peripheral : peripherals_) peripheral->reset(at);
  rcc_.note_reset(cause);
  processor_.reset(at);
  watchdog_fired_ = halted_ = false;
  ++resets_;
}

void VirtualBoard::run_until(BoardTime time) {
  while (now() < time && !flash_.power_is_cut()) {
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
      stand_still_until(flash_.busy_until());
      continue;
    }
    if (watchdog_fired_) {
      reset(ResetCause::independent_watchdog);
    } else if (end == RunEnd::reset_requested) {
      reset(ResetCause::software);
    } else if (end == RunEnd::fault) {
      // Cut in the middle of an erase or a store: nothing runs any more.
      if (flash_.power_is_cut()) return;
      fail();
    } else if (end == RunEnd::stopped) {
      if (browned_out_) continue;
      return;
    }
  }
}

// The one bank is busy and the core gets no instruction, or it is halted. Everything else goes on.
void VirtualBoard::stand_still_until(BoardTime time) {
  while (now() < time && !watchdog_fired_) {
    const BoardTime next = std::min(time, std::max(events_.next_event(), now()));
    processor_.stall_until(next);
    events_.catch_up(next);
  }
  if (watchdog_fired_) reset(ResetCause::independent_watchdog);
}

std::string VirtualBoard::where() const {
  const std::uint32_t address = processor_.program_counter();
  return fmt::format("{} in {} (0x{:08X})", processor_.sleeping() ? "sleeping" : "running",
                     image_.function_at(address), address);
}

void VirtualBoard::fail() const {
  throw std::runtime_error(fmt::format("at {:.6f} s: {}", seconds(processor_.now()), processor_.fault()));
}

void VirtualBoard::run_for(double duration_s) {
  run_until(now() + static_cast<BoardTime>(duration_s * static_cast<double>(units_per_second)));
}

void VirtualBoard::receive(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) usart2_.receive(byte, true, true, now());
}

std::vector<std::uint8_t> VirtualBoard::transmitted() {
  std::vector<std::uint8_t> bytes;
  bytes.swap(transmitted_);
  return bytes;
}

void VirtualBoard::open_emergency_stop(bool open) {
  emergency_stop_open_ = open;
  show_emergency_stop(now());
}

bool VirtualBoard::healthy() const {
  return ports_[static_cast<std::size_t>(pins::healthy.port)].level(pins::healthy.number);
}

bool VirtualBoard::fault_line() const {
  return ports_[static_cast<std::size_t>(pins::gate_driver_fault.port)].level(pins::gate_driver_fault.number);
}

void VirtualBoard::hold_fault_line(bool low) {
  fault_line_held_ = low;
  show_fault_line(now());
}

void VirtualBoard::pull_reset() {
  reset(ResetCause::pin);
}

void VirtualBoard::cycle_power() {
  flash_.power_up(now());
  for (const auto memory : {bus_.sram(), bus_.ccm()}) {
    for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = static_cast<std::uint8_t>(0xA5U ^ (i * 7U));
  }
  reset(ResetCause::power_on);
}

}  // namespace kmax::virtual_board
