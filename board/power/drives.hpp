#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <utility>

#include "board/power/brake_resistor.hpp"
#include "board/power/current_sensors.hpp"
#include "board/power/drive_hardware.hpp"
#include "board/power/encoder_settings.hpp"
#include "board/power/sample_hold.hpp"
#include "board/power/serial_encoder.hpp"
#include "board/power/tick_monitor.hpp"
#include "drivers/current_sense.hpp"
#include "drivers/ntc_thermistor.hpp"
#include "drivers/referenced_quadrature_counter.hpp"
#include "drivers/supply_divider.hpp"
#include "firmware/application.hpp"
#include "firmware/exchange/double_buffer.hpp"
#include "firmware/exchange/interrupt_signal.hpp"

namespace kmax::board {

/// Encoders, current sensors and bridges of all axes, and what the tick does with them: the same code on a
/// board and on x86.
///
/// A tick of an axis, in the interrupt that follows its sample:
///   1  currents and supply are read
///   2  the encoder's counter and its index line, or the frame that the other axis' tick has begun
///   3  the application's tick: force, current reference, duty, trips
///   4  the duty is written, and a frame begun whose chip has been selected since 2
///   5  the brake, if there is one, in the first axis' tick
///
/// A tick that may not drive disarms the bridge. It is armed only when an axis begins to drive, and the power
/// stage's condition is looked at once more after that: a line interrupt in between wins.
///
/// The axes' ticks follow each other in their order and never overlap.
template <typename Hardware>
class Drives {
 public:
  /// `supply_ratio`: of the supply to the voltage at the converter's pin. The rest makes the hardware.
  template <typename... Arguments>
  explicit Drives(float supply_ratio, Arguments&&... hardware)
      : hardware_(std::forward<Arguments>(hardware)...), supply_(supply_ratio) {
    static_assert(DriveHardware<Hardware>);
  }

  Hardware& hardware() { return hardware_; }
  const Hardware& hardware() const { return hardware_; }
  /// The AS5047P, of which a board has one (SerialEncoder) or none.
  decltype(auto) serial_encoder() {
    if constexpr (requires(Hardware & hardware) { hardware.serial_encoder(); }) {
      return hardware_.serial_encoder();
    } else {
      return NoSerialEncoder{};
    }
  }

  /// The whole tick of an axis. The condition is asked twice, so it comes as the object that has it.
  ///
  /// `Application`: firmware::Application, or any AxesTick. Where its law needs all positions, the counters
  /// of all axes are read in each slot.
  template <typename Application, typename Stage>
  [[gnu::always_inline]] inline void ISR_tick(std::size_t axis, Application& application,
                                              const Stage& stage) {
    if (!in_service(axis)) [[unlikely]]
      return ISR_pass(axis, application);
    const firmware::AxisInput& input = ISR_measure(axis, stage);
    if constexpr (Application::needs_all_positions) {
      const auto inputs = ISR_beside_others(axis, input);
      ISR_drive(axis, application.ISR_tick(axis, inputs), input.motor.supply_voltage, stage);
    } else {
      ISR_drive(axis, application.ISR_tick(axis, input), input.motor.supply_voltage, stage);
    }
    ISR_end_round(axis, application);
  }

  /// What goes on in place of an absent axis' tick: settings, the frame of the other axis' encoder, the
  /// brake, and the round.
  template <typename Application>
  [[gnu::noinline, gnu::cold]] void ISR_pass(std::size_t axis, Application& application) {
    ISR_begin_pass(axis);
    application.ISR_tick(axis);
    ISR_end_pass(axis);
    ISR_end_round(axis, application);
  }
  /// The two parts of it that come before and after the application's.
  [[gnu::cold]] void ISR_begin_pass(std::size_t axis);
  [[gnu::cold]] void ISR_end_pass(std::size_t axis);

  /// The two parts of ISR_tick(), before and after the application's, for a board in which all axes are
  /// sampled together.
  template <typename Stage>
  [[gnu::always_inline]] inline const firmware::AxisInput& ISR_measure(std::size_t axis, const Stage& stage);
  template <typename Stage>
  [[gnu::always_inline]] inline void ISR_drive(std::size_t axis, const firmware::AxisOutput& output,
                                               float supply_voltage, const Stage& stage);

  using Bridges = std::array<bool, firmware::axis_count>;
  /// All bridges off, nothing else. Those that were armed.
  Bridges ISR_disarm() {
    Bridges armed{};
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (!hardware_.has(axis)) continue;
      armed[axis] = hardware_.bridge(axis).armed();
      hardware_.bridge(axis).disarm();
    }
    return armed;
  }
  /// The line interrupts, when nothing was meant: gives back what the above has taken. A bridge that does not
  /// come back, or that the missing ticks had taken meanwhile, is found fallen by its axis' tick. The sample
  /// may have been taken with the bridge off: then it shows no current, as an open phase does.
  void ISR_arm_again(const Bridges& armed) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (!armed[axis] || ISR_ticks_stayed_away(axis)) continue;
      samples_.ISR_invalidate(axis);
      static_cast<void>(hardware_.bridge(axis).arm());
    }
  }

  /// A slow clock's interrupt: true when an axis has not ticked between three calls. All bridges and the
  /// brake are off then.
  bool ISR_ticks_have_stopped();

  /// Main loop: what the parameters say, when no axis is armed; and which axes the board does not have.
  void apply(const firmware::ParameterValues& values,
             const std::array<bool, firmware::axis_count>& absent = {});
  bool in_service(std::size_t axis) const { return !absent_[axis].load(std::memory_order_relaxed); }
  std::array<bool, firmware::axis_count> in_service() const {
    std::array<bool, firmware::axis_count> all{};
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) all[axis] = in_service(axis);
    return all;
  }
  /// Amplifier gain that the present current limits need.
  drivers::CurrentSenseGain gain() const { return gain_; }

  /// Main loop, with the bridges off: the current sensors' zero. Ticks must run.
  void restart_offset_calibration();
  OffsetProgress offset_progress();
  /// Main loop, once a millisecond, also while driven: the sensors' zero goes with the board's temperature,
  /// and with what driving does to it. False: a zero is where no sound amplifier has it.
  bool track_offsets();

  /// Main loop: for the application.
  firmware::BoardReadings readings() const;

  /// Main loop: keeps the brake resistor off while the tick cannot look after it.
  void inhibit_brake(bool inhibited) {
    brake_.inhibit(inhibited);
    if (inhibited) hardware_.set_brake(false);
  }

  /// Main loop: all axes have ticked since the last call that said so, and the watchdog may be fed. So the
  /// reset comes when the main loop stands, and when any tick does.
  bool all_have_ticked() { return ticks_.all_have_ticked(has()); }

  /// Once a round of the application, when all axes have reported: the main loop need not look more often.
  bool main_loop_due() { return main_loop_due_.take(); }

 private:
  using Counter = drivers::ReferencedQuadratureCounter<decltype(std::declval<Hardware>().ISR_counter(0))>;
  using Count = typename Counter::Reading;
  /// Generations of the AS5047P's counts have the uppermost bit, so that a change of encoder.kind is one too.
  static constexpr std::uint32_t serial_generations = 0x8000'0000U;
  static constexpr drivers::NtcThermistor thermistor{Hardware::description.thermistor};

  /// What the tick works by; made in the main loop.
  struct Settings {
    EncoderSettings encoders{};
    control::BrakeChopper::Coefficients brake{};
    bool has_brake = false;
  };

  enum class Bridge : std::uint8_t { off, driving, would_not_rise };

  struct Axis {
    firmware::AxisInput input{.motor = {.present = true}};  ///< of its last tick
    std::uint32_t encoder_generation = 0;                   ///< of the settings that have been taken over
    Bridge bridge = Bridge::off;
    CurrentSensors sensors{static_cast<float>(Hardware::description.shunt)};
    Counter counter{};
  };
  using Inputs = std::array<firmware::AxisInput, firmware::axis_count>;

  /// The axis whose tick begins a round: it takes settings over and looks after the brake.
  constexpr std::size_t first_axis() const {
    std::size_t axis = 0;
    while (axis + 1 < firmware::axis_count && !hardware_.has(axis)) ++axis;
    return axis;
  }

  template <typename Application>
  [[gnu::always_inline]] inline void ISR_end_round(std::size_t axis, const Application& application) {
    if (axis + 1 == firmware::axis_count && application.ISR_round_begins()) main_loop_due_.ISR_raise();
  }
  [[gnu::always_inline]] inline void ISR_end_tick(std::size_t axis, float supply_voltage);
  Inputs ISR_beside_others(std::size_t axis, const firmware::AxisInput& input);
  [[gnu::always_inline]] inline void ISR_read_count(std::size_t axis, const Settings& settings, bool driving);
  [[gnu::noinline]] void ISR_brake(const control::BrakeChopper::Coefficients& coefficients,
                                   float supply_voltage) {
    bool driving = false;
    for (const Axis& axis : axes_) driving = driving || axis.bridge == Bridge::driving;
    hardware_.set_brake(brake_.ISR_update(coefficients, supply_voltage, driving));
  }
  std::array<bool, firmware::axis_count> has() const {
    std::array<bool, firmware::axis_count> all{};
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) all[axis] = hardware_.has(axis);
    return all;
  }
  bool is_driven(std::size_t axis) const { return hardware_.has(axis) && in_service(axis); }
  // Rare, and kept out of the tick's one function, whose registers they would take.
  /// Where the board has a watch for that.
  bool ISR_ticks_stayed_away(std::size_t axis) {
    if constexpr (requires { hardware_.bridge(axis).ISR_ticks_stayed_away(); })
      return hardware_.bridge(axis).ISR_ticks_stayed_away();
    return false;
  }
  /// If it was not the ticks, it was the timer's break input.
  [[gnu::noinline, gnu::cold]] firmware::Fault ISR_why_fallen(std::size_t axis) {
    return ISR_ticks_stayed_away(axis) ? firmware::Fault::tick_missed : firmware::Fault::power_stage;
  }
  [[gnu::noinline, gnu::cold]] bool ISR_holds(std::size_t axis, bool valid, std::uint32_t phase_b,
                                              std::uint32_t phase_c) {
    const SampleHold::Action action = samples_.ISR_take(axis);
    if (action.calibrate) axes_[axis].sensors.ISR_calibrate(valid, phase_b, phase_c);
    return action.hold;
  }
  [[gnu::noinline, gnu::cold]] void ISR_configure_encoder(std::size_t axis, const Settings& settings);
  [[gnu::noinline]] void ISR_take_serial(firmware::AxisInput& input);
  static void ISR_without_count(firmware::AxisInput& input) {
    input.count = input.reference_generation = 0;
    input.count_valid = input.referenced = false;
  }
  [[gnu::noinline]] void ISR_select_serial() { serial_encoder().ISR_select(); }
  [[gnu::noinline]] void ISR_begin_serial() { serial_encoder().ISR_begin(); }

  Hardware hardware_;
  drivers::SupplyDivider supply_;
  std::array<Axis, firmware::axis_count> axes_{};
  drivers::CurrentSenseGain gain_ = drivers::CurrentSenseGain::x80;
  BrakeResistor brake_;
  Settings settings_{};
  firmware::DoubleBuffer<Settings> double_buffer_{Settings{}};
  firmware::InterruptSignal main_loop_due_;
  SampleHold samples_;
  std::array<std::atomic<bool>, firmware::axis_count> absent_{};
  TickMonitor ticks_;
};

template <typename Hardware>
template <typename Stage>
inline const firmware::AxisInput& Drives<Hardware>::ISR_measure(std::size_t index, const Stage& stage) {
  Axis& axis = axes_[index];
  const Settings& settings = index == first_axis() ? double_buffer_.ISR_take() : double_buffer_.ISR_current();
  const auto sample = hardware_.ISR_sample(index);
  firmware::AxisInput& input = axis.input;
  const Bridge bridge = axis.bridge;
  const bool driving = bridge == Bridge::driving;
  firmware::Fault condition = firmware::Fault::none;
  // 2 triggers are 50 us: the converter of supply and temperatures stands still.
  if (!sample.valid || sample.slow_age > 2) [[unlikely]] {
    condition = firmware::Fault::tick_missed;
    // What is read then is of nobody.
    if (!sample.valid) samples_.ISR_invalidate(index);
  } else if (supply_.saturated(sample.supply)) [[unlikely]] {
    condition = firmware::Fault::over_voltage;
  } else if (axis.sensors.ISR_saturated(sample.phase_b, sample.phase_c)) [[unlikely]] {
    // Also of a bridge that is off: its amplifiers read zero, and until they are awake the stage says so
    // below.
    condition = firmware::Fault::current_sense;
  }
  if (!samples_.ISR_has_action() || !ISR_holds(index, sample.valid, sample.phase_b, sample.phase_c))
      [[likely]] {
    input.motor.current_b = axis.sensors.ISR_amperes_b(sample.phase_b);
    input.motor.current_c = axis.sensors.ISR_amperes_c(sample.phase_c);
  }
  input.motor.supply_voltage = supply_.volts(sample.supply);
  ISR_read_count(index, settings, driving);
  // Before the condition: a line interrupt in between must be found as what it is.
  const bool bridge_fell = driving ? !hardware_.bridge(index).armed() : bridge != Bridge::off;
  if (const firmware::Fault cause = stage.condition(); cause != firmware::Fault::none) condition = cause;
  // The bridge fell, or would not rise, without anybody saying why.
  if (bridge_fell && condition == firmware::Fault::none) [[unlikely]]
    condition = ISR_why_fallen(index);
  input.condition = condition;
  return input;
}

template <typename Hardware>
inline void Drives<Hardware>::ISR_read_count(std::size_t axis, const Settings& settings, bool driving) {
  firmware::AxisInput& input = axes_[axis].input;
  if (axes_[axis].encoder_generation != settings.encoders.generation[axis]) [[unlikely]]
    ISR_configure_encoder(axis, settings);
  if (settings.encoders.role[axis] != EncoderRole::lines) [[unlikely]] {
    if (settings.encoders.role[axis] == EncoderRole::chip) return ISR_take_serial(input);
    ISR_select_serial();
    if (settings.encoders.role[axis] == EncoderRole::missing) return ISR_without_count(input);
  }
  const auto index_line = [this, axis] { return hardware_.ISR_index_line(axis); };
  const Count count = axes_[axis].counter.ISR_read(hardware_.ISR_counter(axis), index_line, driving);
  input.count = count.count;
  input.count_valid = count.valid;
  input.referenced = count.referenced;
  input.reference_generation = count.reference_generation;
}

/// The input of the axis whose slot it is, and where the others' counters stand in it. What is valid and what
/// it is referred to is as their own last ticks found; so is the angle of an AS5047P, whose frame takes
/// longer.
template <typename Hardware>
typename Drives<Hardware>::Inputs Drives<Hardware>::ISR_beside_others(std::size_t axis,
                                                                      const firmware::AxisInput& input) {
  Inputs inputs{};
  for (std::size_t other = 0; other < firmware::axis_count; ++other) {
    if (!hardware_.has(other)) continue;
    const Axis& of = axes_[other];
    const EncoderRole role = double_buffer_.ISR_current().encoders.role[other];
    const bool on_lines = role == EncoderRole::lines || role == EncoderRole::lines_beside_chip;
    inputs[other].count = on_lines ? of.counter.ISR_peek(hardware_.ISR_counter(other)) : of.input.count;
    inputs[other].count_valid = of.input.count_valid;
    inputs[other].reference_generation = of.input.reference_generation;
  }
  inputs[axis] = input;
  return inputs;
}

template <typename Hardware>
void Drives<Hardware>::ISR_take_serial(firmware::AxisInput& input) {
  const auto angle = serial_encoder().ISR_take();
  input.count = angle.count;
  input.count_valid = angle.valid;
  input.referenced = false;
  input.reference_generation = serial_generations | angle.reference_generation;
}

template <typename Hardware>
void Drives<Hardware>::ISR_configure_encoder(std::size_t axis, const Settings& settings) {
  axes_[axis].encoder_generation = settings.encoders.generation[axis];
  axes_[axis].counter.configure(settings.encoders.quadrature[axis]);
  // Nobody would take the frame any more.
  auto&& serial = serial_encoder();
  if (settings.encoders.role[axis] == EncoderRole::lines && serial.under_way()) serial.ISR_abandon();
}

template <typename Hardware>
template <typename Stage>
inline void Drives<Hardware>::ISR_drive(std::size_t index, const firmware::AxisOutput& output,
                                        float supply_voltage, const Stage& stage) {
  Axis& axis = axes_[index];
  auto& bridge = hardware_.bridge(index);
  const bool has_duty =
      output.enabled && bridge.ISR_set_duty({output.motor.duty_a, output.motor.duty_b, output.motor.duty_c});
  if (!has_duty) {
    bridge.disarm();
    axis.bridge = Bridge::off;
    // The next arming begins without voltage.
    bridge.ISR_set_no_voltage();
  } else if (axis.bridge != Bridge::driving) [[unlikely]] {
    axis.bridge = bridge.arm() ? Bridge::driving : Bridge::would_not_rise;
    if (stage.condition() != firmware::Fault::none) bridge.disarm();
  }
  ISR_end_tick(index, supply_voltage);
}

template <typename Hardware>
void Drives<Hardware>::ISR_begin_pass(std::size_t index) {
  const Settings& settings = index == first_axis() ? double_buffer_.ISR_take() : double_buffer_.ISR_current();
  if (settings.encoders.role[index] == EncoderRole::lines_beside_chip) ISR_select_serial();
  hardware_.bridge(index).disarm();
  axes_[index].bridge = Bridge::off;
  ISR_without_count(axes_[index].input);  // for the other axes
}

template <typename Hardware>
void Drives<Hardware>::ISR_end_pass(std::size_t index) {
  ISR_end_tick(index, supply_.volts(hardware_.ISR_sample(index).supply));
}

template <typename Hardware>
inline void Drives<Hardware>::ISR_end_tick(std::size_t index, float supply_voltage) {
  if (serial_encoder().ISR_selected()) [[unlikely]]
    ISR_begin_serial();
  ticks_.ISR_note(index);
  if (index == first_axis()) {
    const Settings& settings = double_buffer_.ISR_current();
    if (settings.has_brake || brake_.ISR_on()) ISR_brake(settings.brake, supply_voltage);
  }
}

template <typename Hardware>
bool Drives<Hardware>::ISR_ticks_have_stopped() {
  if (!ticks_.ISR_have_stopped(has())) return false;
  static_cast<void>(ISR_disarm());
  hardware_.set_brake(false);
  main_loop_due_.ISR_raise();
  return true;
}

template <typename Hardware>
void Drives<Hardware>::apply(const firmware::ParameterValues& values,
                             const std::array<bool, firmware::axis_count>& absent) {
  Settings settings;
  float largest_current = 0.0f;
  std::array<bool, firmware::axis_count> changed{};
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    changed[axis] = in_service(axis) == absent[axis];
    const float trip = firmware::over_current_factor * values.real<"current.limit">(axis);
    if (!absent[axis] && trip > largest_current) largest_current = trip;
    const auto motor = values.choice<firmware::MotorKind, "motor.kind">(axis);
    // A brushed motor lies between B and C.
    if (hardware_.has(axis))
      static_cast<void>(hardware_.bridge(axis).enable_legs({.a = motor != firmware::MotorKind::dc}));
  }
  settings.encoders = settings_.encoders.next(values, absent, changed);
  settings.brake = control::BrakeChopper::prepare({.on_voltage = values.real<"supply.brake_voltage">()});
  settings.has_brake = settings.brake.on_voltage > 0.0f;
  if (settings.encoders.chip_moves_from(settings_.encoders)) serial_encoder().restart_without_turns();
  settings_ = settings;
  double_buffer_.offer(settings_);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    absent_[axis].store(absent[axis], std::memory_order_relaxed);
  gain_ = drivers::gain_for_current(largest_current, static_cast<float>(Hardware::description.shunt));
}

template <typename Hardware>
void Drives<Hardware>::restart_offset_calibration() {
  samples_.set_calibrating(false);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  for (Axis& axis : axes_) axis.sensors.restart_calibration(gain_);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  samples_.set_calibrating(true);
}

template <typename Hardware>
OffsetProgress Drives<Hardware>::offset_progress() {
  OffsetProgress all = OffsetProgress::accepted;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!is_driven(axis)) continue;
    const OffsetProgress one = axes_[axis].sensors.calibration_progress();
    if (one == OffsetProgress::running) return one;
    if (one == OffsetProgress::refused) all = one;
  }
  samples_.set_calibrating(false);
  if (all == OffsetProgress::accepted) {
    for (Axis& axis : axes_) axis.sensors.take_calibration();
  }
  return all;
}

template <typename Hardware>
bool Drives<Hardware>::track_offsets() {
  bool within = true;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!is_driven(axis)) continue;
    const auto codes = hardware_.zero_current(axis);
    within = axes_[axis].sensors.track_offsets(codes.phase_b, codes.phase_c, gain_,
                                               hardware_.bridge(axis).armed()) &&
             within;
  }
  return within;
}

template <typename Hardware>
firmware::BoardReadings Drives<Hardware>::readings() const {
  firmware::BoardReadings readings;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const drivers::NtcReading reading = thermistor.read(hardware_.temperature_code(axis));
    readings.power_stage_temperature[axis] =
        reading.state == drivers::NtcState::ok ? reading.celsius : std::numeric_limits<float>::quiet_NaN();
    readings.offset_b[axis] = axes_[axis].sensors.offset_b();
    readings.offset_c[axis] = axes_[axis].sensors.offset_c();
  }
  readings.has_power_stage = true;
  readings.modulation_limit = Hardware::description.modulation_limit[static_cast<std::size_t>(gain_)];
  readings.supply_voltage = supply_.volts(hardware_.supply_code());
  readings.missed_ticks = hardware_.missed_ticks();
  return readings;
}

}  // namespace kmax::board
