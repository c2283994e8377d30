#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "board/odrive_v3/gate_drivers.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/odrive_v3/power_stage.hpp"
#include "board/odrive_v3/serial_encoder.hpp"
#include "board/odrive_v3/voltage_variant.hpp"
#include "control/brake_chopper.hpp"
#include "drivers/current_sense.hpp"
#include "drivers/ntc_thermistor.hpp"
#include "drivers/quadrature_index_watch.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "drivers/stm32f4/phase_shifted_pwm.hpp"
#include "drivers/stm32f4/quadrature_timer.hpp"
#include "drivers/supply_divider.hpp"
#include "firmware/application.hpp"
#include "firmware/handover.hpp"
#include "firmware/watchdog_gate.hpp"

namespace kmax::board::odrive_v3 {

/// Encoders, current sensors and bridges of both axes, and what the tick does with them.
///
/// Order of one tick, in the conversions' interrupt 0.7 us after the middle of the axis' low-side window:
///   1  which axis: TIM1 counts up after its underflow (axis 0), down after its overflow (axis 1)
///   2  currents and supply are read, the converters' lists set for the other axis
///   3  the encoder's counter and its index line, or the frame that the other axis' tick has begun
///   4  the application's tick: force, current reference, duty, trips
///   5  the duty is written; it is active from the timer's next turn on, 25 us after the sample
///   6  offsets are averaged while that goes on; the brake, in axis 0's tick
///
/// A tick that may not drive clears MOE. MOE is set only when an axis begins to drive, and the power stage's
/// condition is looked at once more after that: a line interrupt in between wins.
///
/// The two axes' ticks follow each other every 25 us and never overlap.
class Drives {
 public:
  Drives(VoltageVariant variant, ChipBus& bus);

  /// Timers and converters, outputs off. False: the hardware does not do what it is told (an emulator without
  /// timers).
  [[nodiscard]] bool configure(std::uint32_t apb2_hz);
  /// Begins the ticks. False like configure().
  [[nodiscard]] bool start();

  /// The conversions' interrupt. The condition is asked twice, so it comes as the object that has it.
  template <typename Stage>
  void ISR_tick(firmware::Application& application, const Stage& stage);

  /// The line interrupts: both bridges off, nothing else.
  void ISR_disarm() {
    pwm0_.disarm();
    pwm1_.disarm();
  }

  /// Main loop: what the parameters say, when no axis is armed.
  void apply(const firmware::ParameterValues& values);
  /// Amplifier gain that the present current limits need.
  drivers::CurrentSenseGain gain() const { return gain_; }

  void restart_offset_calibration();
  OffsetProgress offset_progress();

  /// Main loop: for the application.
  firmware::BoardReadings readings() const;

  /// Main loop: keeps the brake resistor off while the tick cannot look after it.
  void inhibit_brake(bool inhibited);

  /// SysTick: true when an axis has not ticked between three calls. Both bridges are off then.
  bool ISR_ticks_have_stopped();

  /// Main loop, when the power stage has become ready: the encoder on the bus starts anew.
  void restart_serial_encoder() { serial_encoder_.restart(); }

  /// Both axes have ticked since the last call that said so.
  firmware::WatchdogGate& watchdog_gate() { return watchdog_gate_; }

  /// Every fourth tick of axis 0: the main loop need not look more often.
  bool main_loop_due() { return main_loop_due_.exchange(false, std::memory_order_relaxed); }

 private:
  using Pwm = drivers::stm32f4::ThreePhasePwm<>;
  using Encoder = drivers::stm32f4::QuadratureTimer<>;
  static constexpr std::uint16_t no_voltage_ticks =
      drivers::stm32f4::ThreePhasePwmConfig{}.half_period_ticks / 2;

  /// What the tick works by; made in the main loop.
  struct Settings {
    std::array<drivers::QuadratureIndexConfig, firmware::axis_count> index{};
    std::array<std::uint32_t, firmware::axis_count> index_generation{};
    std::array<bool, firmware::axis_count> has_index{};
    /// The axis whose encoder is the AS5047P on the bus; axis_count: none.
    std::size_t serial_encoder_axis = firmware::axis_count;
    /// Asks for that chip too, and has none.
    std::array<bool, firmware::axis_count> without_encoder{};
    control::BrakeChopper::Coefficients brake{};
  };

  struct AxisHardware {
    drivers::CurrentSense sense_b{}, sense_c{};
    drivers::OffsetCalibration offset_b{}, offset_c{};
    drivers::QuadratureIndexWatch index{};
    std::uint32_t count = 0;
    std::uint32_t index_generation = 0;
    bool driving = false, arm_failed = false;
  };

  firmware::AxisInput ISR_measure(std::size_t axis, const drivers::stm32f4::CurrentSample& sample);
  void ISR_read_quadrature(std::size_t axis, const Settings& settings, firmware::AxisInput& input);
  bool ISR_index_line(std::size_t axis) const;
  void ISR_housekeeping(std::size_t axis, float supply_voltage);
  // Rare, and kept out of the tick's one function, whose registers they would take.
  [[gnu::noinline]] void ISR_calibrate(AxisHardware& hardware, const drivers::stm32f4::CurrentSample& sample);
  [[gnu::noinline]] void ISR_take_serial(firmware::AxisInput& input);
  [[gnu::noinline]] void ISR_begin_serial() { serial_encoder_.ISR_begin(); }

  drivers::SupplyDivider supply_;
  SerialEncoder serial_encoder_;
  Pwm pwm0_, pwm1_;
  Encoder encoder0_, encoder1_;
  drivers::stm32f4::CurrentSampling<> sampling_;
  std::array<AxisHardware, firmware::axis_count> axes_{};
  drivers::CurrentSenseGain gain_ = drivers::CurrentSenseGain::x80;
  control::BrakeChopper brake_;
  firmware::WatchdogGate watchdog_gate_;
  Settings settings_{};
  firmware::Handover<Settings> handover_{Settings{}};
  std::atomic<bool> calibrating_{false};
  std::atomic<bool> main_loop_due_{false};
  std::atomic<bool> brake_inhibited_{false};
  std::uint32_t ISR_ticks_ = 0, ISR_braking_for_ = 0, ISR_silent_calls_ = 0;
  std::array<std::atomic<std::uint32_t>, firmware::axis_count> axis_ticks_{};
  std::array<std::uint32_t, firmware::axis_count> axis_ticks_seen_{};
  // Words that the tick leaves for the main loop.
  std::atomic<std::uint16_t> supply_code_{0};
  std::array<std::atomic<std::uint16_t>, firmware::axis_count> temperature_code_{};
};

}  // namespace kmax::board::odrive_v3
