#pragma once

#include <array>
#include <atomic>
#include <concepts>
#include <cstdint>
#include <limits>
#include <utility>

#include "board/power/power_stage.hpp"
#include "control/brake_chopper.hpp"
#include "drivers/current_sense.hpp"
#include "drivers/ntc_thermistor.hpp"
#include "drivers/referenced_quadrature_counter.hpp"
#include "drivers/supply_divider.hpp"
#include "firmware/application.hpp"
#include "firmware/exchange/double_buffer.hpp"

namespace kmax::board {

/// What the drives need of a board's chip. What begins with ISR_, and the bridge but for enable_legs(), is
/// called in the tick.
template <typename Hardware>
concept DriveHardware = requires(Hardware& hardware, const Hardware& constant, std::size_t axis, bool level) {
  /// False: an axis that this board does not drive. Its other functions are not called.
  { constant.has(axis) } -> std::same_as<bool>;

  /// An axis' three half-bridges (drivers::stm32f4::ThreePhasePwm). A duty is active from the middle of the
  /// PWM period after the sample on; arm() and disarm() act at once.
  { hardware.bridge(axis).arm() } -> std::same_as<bool>;
  { hardware.bridge(axis).armed() } -> std::same_as<bool>;
  {hardware.bridge(axis).disarm()};
  { hardware.bridge(axis).ISR_set_duty({0.5f, 0.5f, 0.5f}) } -> std::same_as<bool>;
  {hardware.bridge(axis).ISR_set_no_voltage()};
  {hardware.bridge(axis).enable_legs({.a = level})};

  /// Codes of the phase currents of an axis and of the supply, of 12 bits. `slow_age`: ticks since the supply
  /// was converted last.
  { hardware.ISR_sample(axis).valid } -> std::convertible_to<bool>;
  { hardware.ISR_sample(axis).phase_b } -> std::convertible_to<std::uint16_t>;
  { hardware.ISR_sample(axis).phase_c } -> std::convertible_to<std::uint16_t>;
  { hardware.ISR_sample(axis).supply } -> std::convertible_to<std::uint16_t>;
  { hardware.ISR_sample(axis).slow_age } -> std::convertible_to<std::uint8_t>;

  /// Any context: the last codes of the same pins while the axis' high sides conduct, or all its switches are
  /// off. The amplifiers have settled then as far as they have at the other end of the period, since duties
  /// lie as far above 0 as below 1.
  { hardware.zero_current(axis).phase_b } -> std::convertible_to<std::uint16_t>;
  { hardware.zero_current(axis).phase_c } -> std::convertible_to<std::uint16_t>;
  /// Of the supply, that the current controllers may use: so that an amplifier of this gain has settled when
  /// it is sampled.
  { constant.modulation_limit(drivers::CurrentSenseGain::x80) } -> std::same_as<float>;

  /// The free-running counter of the axis' quadrature lines, and its index line at the same moment.
  { constant.ISR_counter(axis) } -> std::unsigned_integral;
  { constant.ISR_index_line(axis) } -> std::same_as<bool>;

  /// The high side of the brake's half-bridge, on until the next tick at most. Any context.
  {hardware.set_brake(level)};

  // Main loop: codes converted last, and ticks that came too late or not at all.
  { constant.supply_code() } -> std::same_as<std::uint16_t>;
  { constant.temperature_code(axis) } -> std::same_as<std::uint16_t>;
  { constant.missed_ticks() } -> std::same_as<std::uint32_t>;
};

/// Stands for the AS5047P of a board that has none, no serial_encoder(): an axis whose encoder.kind asks for
/// it has no valid count.
struct NoSerialEncoder {
  struct Sample {
    std::uint32_t count = 0;
    bool valid = false;
    std::uint32_t reference_generation = 0;
  };
  static Sample ISR_take() { return {}; }
  static void ISR_select() {}
  static constexpr bool ISR_selected() { return false; }
  static void ISR_begin() {}
  static bool under_way() { return false; }
  static void ISR_abandon() {}
  static void restart() {}
  static void restart_without_turns() {}
};

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
      : hardware_(std::forward<Arguments>(hardware)...), supply_({.ratio = supply_ratio}) {
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
    const firmware::AxisInput input = ISR_measure(axis, stage);
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
    application.ISR_pass(axis);
    ISR_end_pass(axis);
    ISR_end_round(axis, application);
  }
  /// The two parts of it that come before and after the application's.
  [[gnu::cold]] void ISR_begin_pass(std::size_t axis);
  [[gnu::cold]] void ISR_end_pass(std::size_t axis);

  /// The two parts of ISR_tick(), before and after the application's, for a board in which all axes are
  /// sampled together.
  template <typename Stage>
  [[gnu::always_inline]] inline firmware::AxisInput ISR_measure(std::size_t axis, const Stage& stage);
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
      unusual_.fetch_or(static_cast<std::uint8_t>(spoilt << axis), std::memory_order_relaxed);
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
  bool follow_offsets();

  /// Main loop: for the application.
  firmware::BoardReadings readings() const;

  /// Main loop: keeps the brake resistor off while the tick cannot look after it.
  void inhibit_brake(bool inhibited) {
    brake_inhibited_.store(inhibited, std::memory_order_relaxed);
    if (inhibited) hardware_.set_brake(false);
  }

  /// Main loop: all axes have ticked since the last call that said so, and the watchdog may be fed. So the
  /// reset comes when the main loop stands, and when any tick does.
  bool all_have_ticked();

  /// Once a round of the application, when all axes have reported: the main loop need not look more often.
  bool main_loop_due() { return main_loop_due_.exchange(false, std::memory_order_relaxed); }

 private:
  using Counter = drivers::ReferencedQuadratureCounter<decltype(std::declval<Hardware>().ISR_counter(0))>;
  using Count = typename Counter::Reading;
  /// Generations of the AS5047P's counts have the uppermost bit, so that a change of encoder.kind is one too.
  static constexpr std::uint32_t serial_generations = 0x8000'0000U;
  /// Motors brake while they are driven and a moment after; a supply that is too high for longer is not
  /// theirs.
  static constexpr std::uint32_t braking_ticks_after_driving = firmware::tick_rate_hz / 5;
  static constexpr drivers::NtcThermistor thermistor{};

  /// What an axis' tick does for its count.
  enum class EncoderRole : std::uint8_t {
    lines,              ///< quadrature
    lines_beside_chip,  ///< the same, and makes the frame for the axis whose encoder is the AS5047P
    chip,               ///< takes that frame
    missing,            ///< asks for that chip too and has none; makes the frame like the one above
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

  struct Axis {
    drivers::CurrentSense sense_b{}, sense_c{};
    drivers::OffsetCalibration offset_b{}, offset_c{};
    Counter counter{};
    std::uint32_t encoder_generation = 0;      ///< of the settings that have been taken over
    float current_b = 0.0f, current_c = 0.0f;  ///< A, of its last tick
    bool driving = false, arm_failed = false;
    std::uint8_t held = 0;  ///< ticks in a row, at the last one of which they were those of the tick before
    Count count{};          ///< of its last tick; kept where a law needs all positions
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
    if (axis + 1 == firmware::axis_count && application.ISR_round_begins())
      main_loop_due_.store(true, std::memory_order_relaxed);
  }
  [[gnu::always_inline]] inline void ISR_end_tick(std::size_t axis, float supply_voltage);
  Inputs ISR_beside_others(std::size_t axis, const firmware::AxisInput& input);
  [[gnu::always_inline]] inline Count ISR_read_count(std::size_t axis, const Settings& settings,
                                                     bool driving);
  void ISR_brake(const control::BrakeChopper::Coefficients& coefficients, float supply_voltage);
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
  /// True: the currents of the tick before are to be taken, a few times in a row at most.
  template <typename Sample>
  [[gnu::noinline, gnu::cold]] bool ISR_take_unusual(std::size_t index, const Sample& sample) {
    Axis& axis = axes_[index];
    const auto own = static_cast<std::uint8_t>((spoilt | was_held) << index);
    const std::uint8_t unusual =
        unusual_.fetch_and(static_cast<std::uint8_t>(~own), std::memory_order_relaxed);
    if ((unusual & calibrating) != 0 && sample.valid) {
      axis.offset_b.ISR_add(sample.phase_b);
      axis.offset_c.ISR_add(sample.phase_c);
    }
    if ((unusual & spoilt << index) == 0) return false;
    if ((unusual & was_held << index) == 0) axis.held = 0;
    if (axis.held == longest_held) return false;
    ++axis.held;
    unusual_.fetch_or(static_cast<std::uint8_t>(was_held << index), std::memory_order_relaxed);
    return true;
  }
  [[gnu::noinline, gnu::cold]] void ISR_configure_encoder(std::size_t axis, const Settings& settings);
  [[gnu::noinline]] Count ISR_take_serial();
  [[gnu::noinline]] void ISR_select_serial() { serial_encoder().ISR_select(); }
  [[gnu::noinline]] void ISR_begin_serial() { serial_encoder().ISR_begin(); }

  Hardware hardware_;
  drivers::SupplyDivider supply_;
  std::array<Axis, firmware::axis_count> axes_{};
  drivers::CurrentSenseGain gain_ = drivers::CurrentSenseGain::x80;
  control::BrakeChopper brake_;
  Settings settings_{};
  firmware::DoubleBuffer<Settings> double_buffer_{Settings{}};
  std::atomic<bool> main_loop_due_{false}, brake_inhibited_{false};
  /// What a tick rarely has to look after: offsets that are measured; and, of each axis, a sample that is not
  /// to be believed, and that the one before was not.
  static constexpr std::uint8_t calibrating = 1, spoilt = 1U << 1, was_held = 1U << 4;
  static_assert(firmware::axis_count <= 3);
  static constexpr std::uint8_t longest_held = 3;
  std::atomic<std::uint8_t> unusual_{0};
  bool ISR_brake_on_ = false;
  std::uint32_t ISR_braking_for_ = 0, ISR_silent_calls_ = 0;
  std::array<std::atomic<bool>, firmware::axis_count> absent_{};
  /// An axis' tick sets both bits; who has seen one takes it back.
  static constexpr std::uint8_t for_the_clock = 1, for_the_main_loop = 2;
  std::array<std::atomic<std::uint8_t>, firmware::axis_count> ticked_{};
};

template <typename Hardware>
template <typename Stage>
inline firmware::AxisInput Drives<Hardware>::ISR_measure(std::size_t index, const Stage& stage) {
  Axis& axis = axes_[index];
  const Settings& settings = index == first_axis() ? double_buffer_.ISR_take() : double_buffer_.ISR_current();
  const auto& sample = hardware_.ISR_sample(index);
  // Before anything is stored that may lie where the compiler takes the sample to be: they stay in registers.
  const std::uint16_t phase_b = sample.phase_b, phase_c = sample.phase_c, supply = sample.supply;
  const bool driving = axis.driving;
  firmware::Fault condition = firmware::Fault::none;
  // 2 triggers are 50 us: the converter of supply and temperatures stands still.
  if (!sample.valid || sample.slow_age > 2) [[unlikely]] {
    condition = firmware::Fault::tick_missed;
  } else if (supply_.saturated(supply)) [[unlikely]] {
    condition = firmware::Fault::over_voltage;
  } else if (axis.sense_b.ISR_saturated(phase_b) || axis.sense_c.ISR_saturated(phase_c)) [[unlikely]] {
    // Also of a bridge that is off: its amplifiers read zero, and until they are awake the stage says so
    // below.
    condition = firmware::Fault::current_sense;
  }
  float current_b = axis.sense_b.ISR_amperes(phase_b), current_c = axis.sense_c.ISR_amperes(phase_c);
  if (unusual_.load(std::memory_order_relaxed) != 0) [[unlikely]] {
    if (ISR_take_unusual(index, sample)) {
      current_b = axis.current_b;
      current_c = axis.current_c;
    }
  }
  axis.current_b = current_b;
  axis.current_c = current_c;
  const Count count = ISR_read_count(index, settings, driving);
  // Before the condition: a line interrupt in between must be found as what it is.
  const bool bridge_fell = axis.arm_failed || (driving && !hardware_.bridge(index).armed());
  if (const firmware::Fault cause = stage.condition(); cause != firmware::Fault::none) condition = cause;
  // The bridge fell, or would not rise, without anybody saying why.
  if (bridge_fell && condition == firmware::Fault::none) [[unlikely]]
    condition = ISR_why_fallen(index);
  // Named in full: what is filled with zeros first is filled by a function of the library.
  return {.count = count.count,
          .count_valid = count.valid,
          .condition = condition,
          .motor = {.present = true,
                    .supply_voltage = supply_.volts(supply),
                    .current_b = current_b,
                    .current_c = current_c},
          .reference_generation = count.reference_generation,
          .referenced = count.referenced};
}

template <typename Hardware>
inline typename Drives<Hardware>::Count Drives<Hardware>::ISR_read_count(std::size_t axis,
                                                                         const Settings& settings,
                                                                         bool driving) {
  if (axes_[axis].encoder_generation != settings.encoder_generation[axis]) [[unlikely]]
    ISR_configure_encoder(axis, settings);
  if (settings.role[axis] != EncoderRole::lines) [[unlikely]] {
    if (settings.role[axis] == EncoderRole::chip) return ISR_take_serial();
    ISR_select_serial();
    if (settings.role[axis] == EncoderRole::missing) return {};
  }
  const auto index_line = [this, axis] { return hardware_.ISR_index_line(axis); };
  return axes_[axis].counter.ISR_read(hardware_.ISR_counter(axis), index_line, driving);
}

/// The input of the axis whose slot it is, and where the others' counters stand in it. What is valid and what
/// it is referred to is as their own last ticks found; so is the angle of an AS5047P, whose frame takes
/// longer.
template <typename Hardware>
typename Drives<Hardware>::Inputs Drives<Hardware>::ISR_beside_others(std::size_t axis,
                                                                      const firmware::AxisInput& input) {
  axes_[axis].count = {.count = input.count,
                       .valid = input.count_valid,
                       .referenced = input.referenced,
                       .reference_generation = input.reference_generation};
  Inputs inputs{};
  for (std::size_t other = 0; other < firmware::axis_count; ++other) {
    if (!hardware_.has(other)) continue;
    const Axis& of = axes_[other];
    const EncoderRole role = double_buffer_.ISR_current().role[other];
    const bool on_lines = role == EncoderRole::lines || role == EncoderRole::lines_beside_chip;
    inputs[other].count = on_lines ? of.counter.ISR_peek(hardware_.ISR_counter(other)) : of.count.count;
    inputs[other].count_valid = of.count.valid;
    inputs[other].reference_generation = of.count.reference_generation;
  }
  inputs[axis] = input;
  return inputs;
}

template <typename Hardware>
typename Drives<Hardware>::Count Drives<Hardware>::ISR_take_serial() {
  const auto angle = serial_encoder().ISR_take();
  return {.count = angle.count,
          .valid = angle.valid,
          .referenced = false,
          .reference_generation = serial_generations | angle.reference_generation};
}

template <typename Hardware>
void Drives<Hardware>::ISR_configure_encoder(std::size_t axis, const Settings& settings) {
  axes_[axis].encoder_generation = settings.encoder_generation[axis];
  axes_[axis].counter.configure(settings.quadrature[axis]);
  // Nobody would take the frame any more.
  auto&& serial = serial_encoder();
  if (settings.role[axis] == EncoderRole::lines && serial.under_way()) serial.ISR_abandon();
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
    axis.driving = axis.arm_failed = false;
    // The next arming begins without voltage.
    bridge.ISR_set_no_voltage();
  } else if (!axis.driving) {
    axis.driving = bridge.arm();
    axis.arm_failed = !axis.driving;
    if (stage.condition() != firmware::Fault::none) bridge.disarm();
  }
  ISR_end_tick(index, supply_voltage);
}

template <typename Hardware>
void Drives<Hardware>::ISR_begin_pass(std::size_t index) {
  const Settings& settings = index == first_axis() ? double_buffer_.ISR_take() : double_buffer_.ISR_current();
  if (settings.role[index] == EncoderRole::lines_beside_chip) ISR_select_serial();
  hardware_.bridge(index).disarm();
  axes_[index].driving = axes_[index].arm_failed = false;
  axes_[index].count = {};  // for the other axes
}

template <typename Hardware>
void Drives<Hardware>::ISR_end_pass(std::size_t index) {
  ISR_end_tick(index, supply_.volts(hardware_.ISR_sample(index).supply));
}

template <typename Hardware>
inline void Drives<Hardware>::ISR_end_tick(std::size_t index, float supply_voltage) {
  if (serial_encoder().ISR_selected()) [[unlikely]]
    ISR_begin_serial();
  ticked_[index].store(for_the_clock | for_the_main_loop, std::memory_order_relaxed);
  if (index == first_axis()) {
    const Settings& settings = double_buffer_.ISR_current();
    if (settings.has_brake || ISR_brake_on_) ISR_brake(settings.brake, supply_voltage);
  }
}

template <typename Hardware>
void Drives<Hardware>::ISR_brake(const control::BrakeChopper::Coefficients& coefficients,
                                 float supply_voltage) {
  bool driving = false;
  for (const Axis& axis : axes_) driving = driving || axis.driving;
  if (driving) {
    ISR_braking_for_ = braking_ticks_after_driving;
  } else if (ISR_braking_for_ != 0) {
    --ISR_braking_for_;
  }
  const bool wanted = brake_.update(coefficients, supply_voltage);
  const bool allowed = ISR_braking_for_ != 0 && !brake_inhibited_.load(std::memory_order_relaxed);
  ISR_brake_on_ = wanted && allowed;
  hardware_.set_brake(ISR_brake_on_);
}

template <typename Hardware>
bool Drives<Hardware>::ISR_ticks_have_stopped() {
  bool stopped = false;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!hardware_.has(axis)) continue;
    constexpr std::uint8_t seen = static_cast<std::uint8_t>(~for_the_clock);
    if ((ticked_[axis].fetch_and(seen, std::memory_order_relaxed) & for_the_clock) == 0) stopped = true;
  }
  // Twice in a row: after an erase, in which the core stood still, this may come before the last axis' tick.
  ISR_silent_calls_ = stopped ? ISR_silent_calls_ + 1 : 0;
  if (ISR_silent_calls_ < 2) return false;
  static_cast<void>(ISR_disarm());
  hardware_.set_brake(false);
  main_loop_due_.store(true, std::memory_order_relaxed);
  return true;
}

template <typename Hardware>
bool Drives<Hardware>::all_have_ticked() {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (hardware_.has(axis) && (ticked_[axis].load(std::memory_order_relaxed) & for_the_main_loop) == 0)
      return false;
  }
  for (auto& ticked : ticked_) ticked.fetch_and(for_the_clock, std::memory_order_relaxed);
  return true;
}

template <typename Hardware>
void Drives<Hardware>::apply(const firmware::ParameterValues& values,
                             const std::array<bool, firmware::axis_count>& absent) {
  Settings settings;
  float largest_current = 0.0f;
  // There is one chip: the first axis that asks for it has it.
  bool chip_asked_for = false, chip_moves = false;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (values.whole<"encoder.kind">(axis) == 1 && !absent[axis]) {
      settings.role[axis] = chip_asked_for ? EncoderRole::missing : EncoderRole::chip;
      chip_asked_for = true;
    }
  }
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (chip_asked_for && settings.role[axis] == EncoderRole::lines)
      settings.role[axis] = EncoderRole::lines_beside_chip;
    const bool has_index = values.whole<"encoder.index">(axis) != 0;
    settings.quadrature[axis] = {
        .has_index = has_index,
        // A handle that starts at its rest has its origin there.
        .from_index = has_index && values.whole<"encoder.start">(axis) == 0,
        .counts_per_turn = static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis))};
    const auto role = settings.role[axis], role_before = settings_.role[axis];
    chip_moves = chip_moves || (role == EncoderRole::chip) != (role_before == EncoderRole::chip);
    const bool same = role == role_before && settings.quadrature[axis] == settings_.quadrature[axis];
    const bool stays = in_service(axis) != absent[axis];
    settings.encoder_generation[axis] = settings_.encoder_generation[axis] + (same && stays ? 0U : 1U);
    const float trip = firmware::over_current_factor * values.real<"current.limit">(axis);
    if (!absent[axis] && trip > largest_current) largest_current = trip;
    const auto motor = values.choice<firmware::MotorKind, "motor.kind">(axis);
    // A brushed motor lies between B and C.
    if (hardware_.has(axis))
      static_cast<void>(hardware_.bridge(axis).enable_legs({.a = motor != firmware::MotorKind::dc}));
  }
  settings.brake = control::BrakeChopper::prepare({.on_voltage = values.real<"supply.brake_voltage">()});
  settings.has_brake = settings.brake.on_voltage > 0.0f;
  if (chip_moves) serial_encoder().restart_without_turns();
  settings_ = settings;
  double_buffer_.offer(settings_);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    absent_[axis].store(absent[axis], std::memory_order_relaxed);
  gain_ = drivers::gain_for_current(largest_current);
}

template <typename Hardware>
void Drives<Hardware>::restart_offset_calibration() {
  unusual_.fetch_and(static_cast<std::uint8_t>(~calibrating), std::memory_order_relaxed);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  for (Axis& axis : axes_) {
    axis.sense_b = axis.sense_c = drivers::CurrentSense{{.gain = gain_}};
    axis.offset_b.restart(drivers::offset_window(gain_));
    axis.offset_c.restart(drivers::offset_window(gain_));
  }
  std::atomic_signal_fence(std::memory_order_seq_cst);
  unusual_.fetch_or(calibrating, std::memory_order_relaxed);
}

template <typename Hardware>
OffsetProgress Drives<Hardware>::offset_progress() {
  bool refused = false;
  for (std::size_t index = 0; index < firmware::axis_count; ++index) {
    if (!hardware_.has(index) || !in_service(index)) continue;
    for (const auto* offset : {&axes_[index].offset_b, &axes_[index].offset_c}) {
      if (offset->result() == drivers::OffsetResult::running) return OffsetProgress::running;
      refused = refused || offset->result() != drivers::OffsetResult::accepted;
    }
  }
  unusual_.fetch_and(static_cast<std::uint8_t>(~calibrating), std::memory_order_relaxed);
  if (refused) return OffsetProgress::refused;
  for (Axis& axis : axes_) {
    axis.sense_b.set_offset(axis.offset_b.offset());
    axis.sense_c.set_offset(axis.offset_c.offset());
  }
  return OffsetProgress::accepted;
}

template <typename Hardware>
bool Drives<Hardware>::follow_offsets() {
  const auto window = static_cast<float>(drivers::offset_window(gain_));
  bool within = true;
  for (std::size_t index = 0; index < firmware::axis_count; ++index) {
    if (!hardware_.has(index) || !in_service(index)) continue;
    Axis& axis = axes_[index];
    const auto codes = hardware_.zero_current(index);
    axis.sense_b.follow(codes.phase_b);
    axis.sense_c.follow(codes.phase_c);
    for (const auto* sense : {&axis.sense_b, &axis.sense_c}) {
      const float off = sense->offset() - drivers::CurrentSense::middle_code;
      within = within && off <= window && off >= -window;
    }
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
  }
  readings.has_power_stage = true;
  readings.modulation_limit = hardware_.modulation_limit(gain_);
  readings.supply_voltage = supply_.volts(hardware_.supply_code());
  readings.missed_ticks = hardware_.missed_ticks();
  return readings;
}

}  // namespace kmax::board
