#pragma once

#include <bit>
#include <cstdint>

#include "control/count_extender.hpp"
#include "control/force_compensation.hpp"
#include "control/haptic_loop.hpp"
#include "control/motion_plausibility.hpp"
#include "firmware/drive/excitation.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/drive/motor_control.hpp"

namespace kmax::firmware {

/// What an armed axis does; the numbers are those of drive.mode.
enum class DriveMode : std::uint8_t {
  haptic = 0,
  excitation = 1,  ///< follows excitation.*, without a wall
  torque = 2,      ///< makes the force that the host asks for, without a wall
};

/// Between which voltages a supply must be. From 0 up, numbers are ordered as their bits are, and what is
/// negative or no number lies above all of them; so one comparison of whole numbers does, and is shorter.
class SupplyWindow {
 public:
  constexpr SupplyWindow() : SupplyWindow(0.0f, 0.0f) {}
  /// V, 0 <= low <= high; of anything else no voltage is within.
  constexpr SupplyWindow(float low, float high)
      : low_(low >= 0.0f && low <= high ? std::bit_cast<std::uint32_t>(low + 0.0f) : beyond_all),
        width_(low_ == beyond_all ? 0 : std::bit_cast<std::uint32_t>(high) - low_) {}
  constexpr bool contains(float voltage) const {
    return std::bit_cast<std::uint32_t>(voltage) - low_ <= width_;
  }
  /// All of it is below that; not below what is no number.
  constexpr bool is_below(float voltage) const { return voltage > high(); }
  constexpr float high() const { return std::bit_cast<float>(low_ + width_); }

 private:
  static constexpr std::uint32_t beyond_all = 0xFFFFFFFFU;  // no number

  std::uint32_t low_, width_;
};

/// What the tick of one axis works by; made in the main loop, handed over whole.
///
/// What each tick reads comes first: the core's shortest loads of floats reach 1 KiB.
struct AxisSetting {
  std::uint32_t generation = 0;  ///< differs from the last one: estimators start afresh
  DriveMode mode = DriveMode::haptic;
  bool watch_motion = false;  ///< `plausibility` trips, except in mode excitation
  /// False: nobody knows the rotor's angle yet. Excitations of a synchronous motor that need it then ask for
  /// nothing; mode haptic is the main loop's to refuse.
  bool commutated = true;
  std::int32_t encoder_offset = 0;     ///< counts
  std::int32_t encoder_direction = 1;  ///< +1 or -1
  SupplyWindow supply{};
  control::HapticLoop<float>::Coefficients haptic{};
  MotorControl::Coefficients motor{};
  control::MotionPlausibility<float>::Coefficients plausibility{};  ///< for Axis::motion_look ticks a call
  control::ForceCompensation<float>::Coefficients compensation{};   ///< by the shaft's angle
  Excitation::Coefficients excitation{};
};

/// What was when a trip happened. Before the motor was commanded in that tick (any fault but those of motor
/// and motion), force and currents are those of the tick before: the last ones under force.
struct TripRecord {
  std::int64_t position{};  ///< counts, offset and direction applied
  std::uint32_t tick{};
  float velocity{};           ///< m/s
  float force{};              ///< N, asked for
  float current{};            ///< A
  float current_reference{};  ///< A
  float supply{};             ///< V; 0 on a board that has none
  float value{};              ///< what the fault is about, in the unit that fault.hpp gives
  Fault fault = Fault::none;
};

/// What the tick of one axis reports to the main loop. To fill it is part of the tick: it costs 60
/// instructions.
struct AxisReport {
  control::HapticLoop<float>::Output haptic{};
  MotorControl::Report motor{};
  std::int64_t counted = 0;  ///< the encoder's extended count, before offset and direction
  TripRecord trip{};         ///< only while there is a `fault`, its; else whatever was
  std::uint32_t tick = 0;
  std::uint32_t generation = 0;            ///< of the setting it was computed with
  std::uint32_t reference_generation = 0;  ///< of the counts
  std::uint32_t armed_samples = 0, limited_samples = 0;
  std::uint32_t alarms = 0;  ///< since arming: so often the wall was called unstable
  control::InstabilityDetector<float>::Alarm last_alarm{};  ///< only while there are `alarms`
  float softening = 1.0f;                                   ///< factor on the wall's force
  float force = 0.0f;             ///< N asked for with all that is added; 0 unless driven
  Fault fault = Fault::none;      ///< kept until the axis has been disabled
  Fault condition = Fault::none;  ///< of the board: what would keep the axis from being driven now
  float fault_value = 0.0f;       ///< likewise, like `trip`
  bool enabled = false;           ///< as the main loop had asked
  bool count_valid = false;       ///< the encoder's last count
  bool referenced = false;        ///< the counts are those from the encoder's index
};

/// One axis in the tick: from encoder counter to force and on to the motor's duty, with the trips that must
/// act at once.
///
/// A trip removes the force in the tick that finds it and stays until enabled has been seen false: the main
/// loop disables the axis when it reads the fault, so force never comes back by itself.
class Axis {
 public:
  struct Input {
    std::uint32_t count = 0;  ///< free-running, wraps at 2^32
    bool count_valid = false;
    Fault condition = Fault::none;  ///< what the board has found wrong with power stage or lines
    bool referenced = false;        ///< the counts are those from the encoder's index
    std::uint8_t reserved = 0;      ///< 0; these four bytes are read as one word
    MotorControl::Measured motor{};
    /// Another number: the counts are referred to another origin from this tick on, as when the index was
    /// passed first. Never while the axis is driven: that trips.
    std::uint32_t reference_generation = 0;
  };
  struct Output {
    /// N along +x, with compensation; 0 unless enabled. Within force.limit, except in mode excitation.
    float force;
    bool enabled;  ///< false: the bridge must be off
    MotorControl::Output motor{};
  };

  /// What is wanted of the axis from outside it; forces are N along +x.
  struct Command {
    bool enable = false;
    float from_axes = 0.0f;  ///< mode haptic: what a law over several axes adds to the wall
    float from_host = 0.0f;  ///< mode torque: all of the force
    /// What is left of the force, 0 to 1, while it fades after its commander was lost; less than 0: none, and
    /// the motor brakes, see MotorControl::brake().
    float share = 1.0f;
    static constexpr float brakes = -1.0f;
  };

  /// Defined apart, so that it is one function in the image whose arguments and result a test can follow.
  /// The result is valid until the next call.
  const Output& ISR_tick(const AxisSetting& setting, const Input& input, const Command& command,
                         std::uint32_t tick);

  /// Ticks between two looks at the motion's plausibility, a power of two.
  static constexpr std::uint32_t motion_look = 8;

  /// In place of ISR_tick(), for an axis that the board does not have: no valid count, nothing driven.
  void ISR_pass(const AxisSetting& setting, std::uint32_t tick) {
    tick_ = tick;
    generation_ = setting.generation;
    state_ = changes_ = 0;
    reference_generation_ = no_reference;
  }

  /// Where another axis' slot finds this one, which does not tick in it: counts, by this axis' last setting.
  /// Needs input.count_valid and a reference that this axis' own tick has taken over, see ISR_follows().
  std::int64_t ISR_position(std::uint32_t count, const AxisSetting& setting) const {
    return position_of(extender_.peek(count), setting);
  }
  bool ISR_follows(const Input& input) const {
    return input.count_valid && reference_generation_ == input.reference_generation;
  }

  /// A fault found outside: no force from the next ISR_tick() on, until the axis has been disabled. `input`:
  /// of the present tick.
  void ISR_trip(Fault fault, const Input& input) {
    if (trip_ == Fault::none) trip(fault, 0.0f, loop_.output().position, input);
  }

  /// Where an encoder count is on the handle's axis, counts.
  static constexpr std::int64_t position_of(std::int64_t counted, const AxisSetting& setting) {
    const std::int64_t moved = counted - setting.encoder_offset;
    return setting.encoder_direction < 0 ? -moved : moved;
  }

  /// Of the last tick: a fault, an enable, a validity or a condition has changed. The main loop must not act
  /// on what was before.
  bool ISR_changed() const { return changes_ != 0; }
  const control::HapticLoop<float>::Output& ISR_haptic() const { return loop_.output(); }
  /// Of the last tick, N, outwards: field and F_B while a wall is rendered. What a simulated person answers
  /// to; no board asks for it, and none pays for it.
  float ISR_background_force(const AxisSetting& setting) const {
    const bool rendering = output_.enabled && setting.mode == DriveMode::haptic;
    return rendering ? loop_.background_force(setting.haptic) : 0.0f;
  }
  /// Ticks from now that would change nothing but the time, on an axis without a power stage: it follows its
  /// wall, or is idle, between two haptic samples. 0 wherever a tick may do more. `enable`: as it will be.
  /// For a simulation, as ISR_pass_held().
  std::uint32_t ISR_held_ticks(const AxisSetting& setting, bool enable) const {
    const bool steady = changes_ == 0 && trip_ == Fault::none && output_.enabled == enable &&
                        generation_ == setting.generation && setting.mode != DriveMode::excitation &&
                        !(setting.compensation.limit > 0.0f);
    return steady ? loop_.held_ticks() : 0;
  }
  /// In place of so many ticks.
  void ISR_pass_held(std::uint32_t ticks) {
    tick_ += ticks;
    loop_.pass_held(ticks);
  }
  /// Of the last tick: the encoder's extended count, before offset and direction.
  std::int64_t ISR_counted() const { return extender_.count(); }
  Fault ISR_fault() const { return trip_; }
  void ISR_fill(AxisReport& report) const;
  AxisReport ISR_report() const {
    AxisReport report;
    ISR_fill(report);
    return report;
  }

 private:
  // All that the main loop must hear of at once, in one word: one comparison finds any change. Four bytes:
  // the first three of the input as they are, the trip in the last.
  static constexpr unsigned condition_shift = 8, trip_shift = 24;
  static constexpr std::uint32_t count_valid_bit = 1, referenced_bit = 1U << 16, enabled_bit = 1U << 17,
                                 unreported_bit = 1U << 31;
  /// No board counts so many references.
  static constexpr std::uint32_t no_reference = 0x7FFFFFFFU;
  static constexpr bool looks_at_motion(std::uint32_t tick) { return tick % motion_look == 3; }

  static constexpr std::uint32_t trip_bits(Fault trip) {
    return static_cast<std::uint32_t>(trip) << trip_shift;
  }
  static constexpr Fault condition_in(std::uint32_t state) {
    return static_cast<Fault>(state >> condition_shift & 0xFFU);
  }

  // What is rare, or for identification, is kept out of the tick's one function, whose registers it would
  // take.
  [[gnu::noinline, gnu::cold]] void start_afresh();
  [[gnu::noinline, gnu::cold]] void take_reference(const Input& input, bool enable);
  [[gnu::noinline, gnu::cold]] void trip(Fault fault, float value, std::int64_t position, const Input& input);
  [[gnu::noinline, gnu::cold]] bool trip_in_drive(Fault fault, float value, const AxisSetting& setting,
                                                  const Input& input);
  [[gnu::noinline]] bool excite_or_release(const AxisSetting& setting, const Input& input,
                                           std::uint32_t state, bool brakes);
  [[gnu::noinline, gnu::cold]] void take_change(std::uint32_t state);
  void find_trips(const AxisSetting& setting, const Input& input, Fault condition);
  [[gnu::cold]] float excite(const AxisSetting& setting, const Input& input);
  [[gnu::noinline]] float compensated(const AxisSetting& setting, std::uint32_t position) const;
  [[gnu::noinline, gnu::cold]] static std::uint32_t with_supply_fault(std::uint32_t status,
                                                                      const AxisSetting& setting,
                                                                      const Input& input);
  [[gnu::always_inline]] inline bool drive(const AxisSetting& setting, const Input& input,
                                           std::uint32_t position, float share);
  /// m/s along +x since the last look; takes this place for the next one.
  float velocity_since_look(const AxisSetting& setting);

  // What each tick needs comes first, as in AxisSetting.
  Output output_{};
  std::uint32_t tick_ = 0, generation_ = 0;
  std::uint32_t reference_generation_ = no_reference;
  Fault trip_ = Fault::none;
  std::uint32_t state_ = 0;    ///< of the last tick, laid out as above
  std::uint32_t changes_ = 0;  ///< its bits that the last tick has changed
  control::CountExtender<std::uint32_t> extender_;
  float forces_made_ = 0.0f;       ///< N, the sum since the last look at the motion
  std::uint32_t looked_from_ = 0;  ///< low word of the extended count at that look
  control::MotionPlausibility<float> plausibility_;
  MotorControl motor_;
  control::HapticLoop<float> loop_;
  std::uint32_t armed_from_ = 0;                           ///< the loop's samples when the axis was armed
  std::uint32_t armed_samples_ = 0, limited_samples_ = 0;  ///< of the last time it was armed
  std::int64_t armed_at_ = 0;                              ///< extended count where the axis was armed
  TripRecord record_{};
  Excitation excitation_;
};

}  // namespace kmax::firmware
