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
#include "drivers/referenced_quadrature_counter.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "drivers/stm32f4/phase_shifted_pwm.hpp"
#include "drivers/stm32f4/quadrature_timer.hpp"
#include "drivers/supply_divider.hpp"
#include "firmware/application.hpp"
#include "firmware/double_buffer.hpp"
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
///   6  the brake, if there is one, in axis 0's tick
/// Which axis is a constant of its code: there are two copies of the tick.
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

  /// Main loop, when the power stage has become ready: the encoder on the bus starts again.
  void restart_serial_encoder() { serial_encoder_.restart(); }

  /// Both axes have ticked since the last call that said so.
  firmware::WatchdogGate& watchdog_gate() { return watchdog_gate_; }

  /// Once a round of the application, when both axes have reported: the main loop need not look more often.
  bool main_loop_due() { return main_loop_due_.exchange(false, std::memory_order_relaxed); }

 private:
  using Pwm = drivers::stm32f4::ThreePhasePwm<>;
  using Encoder = drivers::stm32f4::QuadratureTimer<>;
  using QuadratureCounter = drivers::ReferencedQuadratureCounter<>;
  using Count = QuadratureCounter::Reading;
  /// Generations of the AS5047P's counts have the uppermost bit, so that a change of encoder.kind is one too.
  static constexpr std::uint32_t serial_generations = 0x8000'0000U;
  static constexpr std::uint16_t no_voltage_ticks =
      drivers::stm32f4::ThreePhasePwmConfig{}.half_period_ticks / 2;

  /// What an axis' tick does for its count.
  enum class EncoderRole : std::uint8_t {
    lines,              ///< quadrature
    lines_beside_chip,  ///< the same, and begins the frame for the other axis, whose encoder is the AS5047P
    chip,               ///< takes that frame
    missing,            ///< asks for that chip too and has none; begins the frame for the other axis
  };

  /// What the tick works by; made in the main loop.
  struct Settings {
    std::array<EncoderRole, firmware::axis_count> role{};
    std::array<drivers::ReferencedQuadratureConfig, firmware::axis_count> quadrature{};
    /// Raised with each change of the above.
    std::array<std::uint32_t, firmware::axis_count> encoder_generation{};
    control::BrakeChopper::Coefficients brake{};
    bool has_brake = false;
  };

  struct AxisHardware {
    drivers::CurrentSense sense_b{}, sense_c{};
    drivers::OffsetCalibration offset_b{}, offset_c{};
    QuadratureCounter counter{};
    std::uint32_t encoder_generation = 0;  ///< of the settings that have been taken over
    bool driving = false, arm_failed = false;
  };

  template <std::size_t axis, typename Stage>
  void ISR_tick_of(firmware::Application& application, const Stage& stage);
  template <std::size_t axis>
  firmware::AxisInput ISR_measure(const Settings& settings, const drivers::stm32f4::CurrentSample& sample);
  template <std::size_t axis>
  Count ISR_read_count(const Settings& settings, bool driving);
  template <std::size_t axis>
  Count ISR_read_quadrature(bool driving);
  void ISR_brake(const control::BrakeChopper::Coefficients& coefficients, float supply_voltage);
  // Rare, and kept out of the tick's one function, whose registers they would take.
  [[gnu::noinline, gnu::cold]] void ISR_calibrate(AxisHardware& hardware,
                                                  const drivers::stm32f4::CurrentSample& sample);
  [[gnu::noinline, gnu::cold]] void ISR_configure_encoder(std::size_t axis, const Settings& settings);
  [[gnu::noinline]] Count ISR_take_serial();
  [[gnu::noinline]] void ISR_begin_serial() { serial_encoder_.ISR_begin(); }

  drivers::SupplyDivider supply_;
  SerialEncoder<> serial_encoder_;
  Pwm pwm0_, pwm1_;
  Encoder encoder0_, encoder1_;
  drivers::stm32f4::CurrentSampling<> sampling_;
  std::array<AxisHardware, firmware::axis_count> axes_{};
  drivers::CurrentSenseGain gain_ = drivers::CurrentSenseGain::x80;
  control::BrakeChopper brake_;
  firmware::WatchdogGate watchdog_gate_;
  Settings settings_{};
  firmware::DoubleBuffer<Settings> handover_{Settings{}};
  std::atomic<bool> calibrating_{false};
  std::atomic<bool> main_loop_due_{false};
  std::atomic<bool> brake_inhibited_{false};
  bool ISR_brake_on_ = false;
  std::uint32_t ISR_braking_for_ = 0, ISR_silent_calls_ = 0;
  std::array<std::atomic<std::uint32_t>, firmware::axis_count> axis_ticks_{};
  std::array<std::uint32_t, firmware::axis_count> axis_ticks_seen_{};
};

}  // namespace kmax::board::odrive_v3
