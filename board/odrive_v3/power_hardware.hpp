#pragma once

#include <cstdint>

#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/gate_drivers.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/power/power.hpp"
#include "board/power/serial_encoder.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "drivers/stm32f4/one_pulse_output.hpp"
#include "drivers/stm32f4/phase_shifted_pwm.hpp"
#include "drivers/stm32f4/quadrature_timer.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/tick_watch.hpp"

namespace kmax::board::odrive_v3 {

/// Timers, converters, lines and gate drivers of both axes (board::MotorHardware).
///
/// The conversions' interrupt comes 1.4 us after the middle of an axis' low-side window, the two axes' every
/// 25 us in turn: TIM1 counts up after its underflow (axis 0), down after its overflow (axis 1). A duty is
/// active from the timer's next turn on, 25 us after the sample.
///
/// Nothing outlives the ticks: TickWatch ends the duties, and the brake's high side is a pulse of TIM2 that
/// ends by itself before the next tick begins another one, which also leaves its bootstrap capacitor time to
/// fill.
class PowerHardware {
 public:
  static constexpr const BoardDescription& description = odrive_v3::description;

  explicit PowerHardware(ChipBus& bus)
      : gate_drivers_(bus),
        serial_encoder_(bus, pin(pins::encoder_select)),
        bridge0_(drivers::stm32f4::tim1(), pwm_config),
        bridge1_(drivers::stm32f4::tim8(), pwm_config),
        encoder0_(drivers::stm32f4::tim3()),
        encoder1_(drivers::stm32f4::tim4()),
        sampling_(drivers::stm32f4::adc(1), drivers::stm32f4::adc(2), drivers::stm32f4::adc(3),
                  drivers::stm32f4::adc_common(), sampling_config),
        brake_(drivers::stm32f4::tim2()),
        watch_(drivers::stm32f4::tim1(), drivers::stm32f4::tim8(), drivers::stm32f4::dma2()) {}

  /// Timers and converters, outputs off. False: the hardware does not do what it is set to.
  [[nodiscard]] bool configure(std::uint32_t apb2_hz) {
    brake_.configure(brake_pulse_ticks);
    return configure_bridges() && encoder0_.configure({}) && encoder1_.configure({}) &&
           sampling_.configure(apb2_hz);
  }
  /// Begins the ticks. False like configure().
  [[nodiscard]] bool start() {
    // The start itself triggers once: as a sample of axis 0.
    sampling_.start(0);
    if (!drivers::stm32f4::start_phase_shifted(bridge0_, bridge1_)) return false;
    watch_.start(pwm_config.half_period_ticks);
    return true;
  }
  /// At the beginning of each tick.
  void ISR_tick_begins() { watch_.ISR_tick(); }
  /// In the conversions' interrupt: whose they are.
  bool ISR_sampled_axis_1() const { return bridge0_.counting_down(); }

  static_assert(firmware::axis_count == 2, "the board has two bridges");
  static constexpr bool has(std::size_t) { return true; }
  auto& bridge(std::size_t axis) { return axis == 0 ? bridge0_ : bridge1_; }
  drivers::stm32f4::CurrentSample ISR_sample(std::size_t axis) {
    return sampling_.ISR_read(static_cast<unsigned>(axis));
  }
  drivers::stm32f4::ZeroCurrentCodes zero_current(std::size_t axis) const {
    return sampling_.zero_current(static_cast<unsigned>(axis));
  }
  std::uint16_t ISR_counter(std::size_t axis) const {
    return axis == 0 ? encoder0_.count() : encoder1_.count();
  }
  bool ISR_index_line(std::size_t axis) const {
    return pin(axis == 0 ? pins::encoder0_index : pins::encoder1_index).read();
  }
  auto& serial_encoder() { return serial_encoder_; }
  /// For the length of a pulse.
  void set_brake(bool on) { on ? brake_.start() : brake_.stop(); }

  std::uint32_t supply_code() const { return sampling_.supply(); }
  std::uint16_t temperature_code(std::size_t axis) const {
    return sampling_.temperature(static_cast<unsigned>(axis));
  }
  std::uint32_t missed_ticks() const {
    return sampling_.counters().overruns + sampling_.counters().axis_mismatches;
  }

  void set_gate_enable(bool level) { pin(pins::gate_enable).write(level); }
  bool fault_line_low() const { return !pin(pins::gate_driver_fault).read(); }
  /// The contact to ground is closed while all is well; an open line is pulled up.
  bool emergency_stop_open() const { return pin(pins::emergency_stop).read(); }
  GateDriverAnswer configure_gate_driver(std::size_t axis, drivers::CurrentSenseGain gain) {
    return gate_drivers_.configure(axis, gain);
  }
  std::uint16_t read_gate_driver_faults(std::size_t axis) { return gate_drivers_.read_faults(axis); }
  void show_healthy(bool healthy) { pin(pins::healthy).write(healthy); }

 private:
  [[nodiscard]] bool configure_bridges() {
    if (!bridge0_.configure() || !bridge1_.configure()) return false;
    if (!bridge0_.break_is_held() && !bridge1_.break_is_held()) return true;
    namespace stm32 = drivers::stm32f4;
    stm32::rcc().apb2rstr = stm32::rcc_apb2enr::Timer1::mask | stm32::rcc_apb2enr::Timer8::mask;
    stm32::rcc().apb2rstr = 0;
    bridge0_.break_when_low();
    bridge1_.break_when_low();
    return bridge0_.configure() && bridge1_.configure();
  }

  /// TIM2 has half the core's clock.
  static constexpr auto brake_pulse_ticks =
      static_cast<std::uint32_t>(description.brake_pulse * description.core_clock_hz / 2);

  static drivers::stm32f4::GpioPin<> pin(PinLocation location) {
    return {drivers::stm32f4::gpio(location.port), location.number};
  }

  GateDrivers gate_drivers_;
  SerialEncoder<ChipBus, drivers::stm32f4::GpioPin<>> serial_encoder_;
  drivers::stm32f4::ThreePhasePwm<> bridge0_, bridge1_;
  drivers::stm32f4::QuadratureTimer<> encoder0_, encoder1_;
  drivers::stm32f4::CurrentSampling<> sampling_;
  drivers::stm32f4::OnePulseOutput<> brake_;
  drivers::stm32f4::TickWatch<> watch_;
};

/// The conversions' interrupt. In a file of its own, compiled for speed.
void ISR_tick(Power<PowerHardware>& power, firmware::Application::Tick& axes);
/// A tick of all axes without encoders and power stage.
void tick_without_power(firmware::Application& application);

}  // namespace kmax::board::odrive_v3
