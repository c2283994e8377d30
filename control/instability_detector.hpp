#pragma once

#include <cstdint>
#include <limits>

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct InstabilityDetectorConfig {
  Scalar force_threshold = Scalar(0.3);          ///< N, amplitude (half of peak to peak), > 0
  Scalar displacement_threshold = Scalar(8e-5);  ///< m, amplitude, > 0
  Scalar lowest_frequency = Scalar(15);          ///< Hz, > 0: what is slower is a hand's own motion
  Scalar settling_time = Scalar(0.055);  ///< s, > 0: an oscillation must not have died down over this long
  Scalar rate = Scalar(20000);           ///< samples per second
};

/// Finds a wall that oscillates under the hand, as one that is too stiff for its rate does.
///
/// An oscillation repeats and lasts; a tap does not repeat, and what a hit leaves behind dies down. So:
///
///   turn      the displacement comes back from its farthest by twice the displacement threshold
///   cycle     two turns within a period of lowest_frequency, over which the force swings by at least twice
///             the force threshold as well
///   energy    displacement amplitude x force amplitude / 2, J, averaged over cycles that follow each other
///             without a gap, in spans of settling_time
///   unstable  a span has at least 3/4 of the energy of the span before it
///
/// After the first cycle the verdict takes two spans, or three; a span ends with a turn. It is passed again
/// after every span: it falls when the oscillation dies down, and at the latest a period of lowest_frequency
/// after the last turn. Amplitudes are those of the last cycle: half of the way between two turns, the mean
/// of there and back, which leaves slow motion out; both are 0 where nothing oscillates. Of an alarm those of
/// its strongest span are kept, by the force.
///
/// For certain: no signal whose displacement or whose force stays within twice its threshold, peak to peak,
/// is ever called unstable, and neither is one slower than lowest_frequency. A steady sine from
/// lowest_frequency to a tenth of the rate is found within 0.3 s as configured by default if both amplitudes
/// exceed their thresholds by 6 % (5 % are what samples miss of a peak of ten samples). There is no upper end
/// of the band: nothing that moves a handle so far and so fast is a hand. The mirrored signal gives the
/// same; displacement, force and both thresholds times a power of two give the same to the bit.
///
/// Turns are found as in "A time-domain vibration observer and controller for physical human-robot
/// interaction" (Lecours, Otis, Belzile, Gosselin 2016), extrema robust against noise: no filter, so no
/// drift, no warm-up and the same thresholds at every rate. How often simulated people's unstable walls
/// are found, how soon, and what it says of stable ones: docs/instability_detector.md.
///
/// It sleeps until the force exceeds a quarter of its threshold, and again a period of lowest_frequency
/// after the force was last beyond it: in free space it costs next to nothing, and a handle that bounces
/// out of the wall and back stays watched. Values that are not finite begin the search anew and never stay
/// in the state. Counters stop where they mean "long ago".
///
/// No heap, libm, virtual call or loop. Executed on a Cortex-M4F per sample: asleep 17 instructions, in
/// contact 48, at a turn 158.
template <typename Scalar>
class InstabilityDetector {
 public:
  struct Coefficients {
    Scalar swing{};            ///< m peak to peak
    Scalar force_swing{};      ///< N peak to peak
    Scalar waking_force{};     ///< N
    std::uint32_t longest{};   ///< samples of the longest period
    std::uint32_t settling{};  ///< samples
    Scalar rate{};             ///< samples per second
  };

  /// From the verdict "unstable" until it falls.
  struct Alarm {
    Scalar force{};         ///< N, amplitude
    Scalar displacement{};  ///< m, amplitude
    Scalar frequency{};     ///< Hz
  };

  /// Outside the interrupt.
  static constexpr Coefficients prepare(const InstabilityDetectorConfig<Scalar>& config) {
    Coefficients c;
    c.swing = Scalar(2) * config.displacement_threshold;
    c.force_swing = Scalar(2) * config.force_threshold;
    c.waking_force = Scalar(0.25) * config.force_threshold;
    // A period may begin and end anywhere within a sample.
    c.longest = samples(config.rate / config.lowest_frequency) + 1;
    c.settling = samples(config.settling_time * config.rate);
    c.rate = config.rate;
    return c;
  }

  /// As if nothing had been touched yet, but for the alarms that were. Needed when the displacement has
  /// another origin or scale.
  void reset() {
    if (awake_ == 0) return;
    awake_ = 0;
    calm_down();
  }

  /// One haptic sample. `displacement`: m from the surface, or from any other fixed place near it. `force`: N
  /// that the wall asks for, with the sign that pushes the displacement up where the wall pushes out. True:
  /// unstable.
  bool update(const Coefficients& c, Scalar displacement, Scalar force) {
    if (magnitude(force) > c.waking_force) {
      if (awake_ == 0) [[unlikely]]
        wake(c, force);
      awake_ = c.longest;
    } else {
      if (awake_ == 0) return false;
      if (--awake_ == 0) [[unlikely]]
        calm_down();
    }
    if (since_turn_ < c.longest) {
      if (++since_turn_ == c.longest) [[unlikely]]
        calm_down();
    }
    if (force < lowest_) lowest_ = force;
    if (force > highest_) highest_ = force;
    const Scalar along = direction_ * displacement;
    if (along > farthest_) {
      farthest_ = along;
    } else if (farthest_ - along >= c.swing) [[unlikely]] {
      turn(c, along, force);
    }
    return unstable_;
  }

  bool unstable() const { return unstable_; }                                ///< as the last update() gave it
  Scalar displacement_amplitude() const { return displacement_amplitude_; }  ///< m
  Scalar force_amplitude() const { return force_amplitude_; }                ///< N
  std::uint32_t alarms() const { return alarms_; }                           ///< since forget_alarms()
  const Alarm& last_alarm() const { return last_alarm_; }  ///< likewise; all 0: there was none
  void forget_alarms() {
    alarms_ = 0;
    last_alarm_ = {};
  }

 private:
  static constexpr Scalar kept = Scalar(0.75);

  /// At least one; a count that is too large for a counter, or no number, becomes 1e9.
  static constexpr std::uint32_t samples(Scalar count) {
    if (!(count < Scalar(1e9))) return 1000000000U;
    return count < Scalar(1) ? 1U : static_cast<std::uint32_t>(count);
  }

  /// The first motion of a contact is into the wall, against its force: the first turn is then found early,
  /// and mirrored signals are treated alike.
  [[gnu::noinline, gnu::cold]] void wake(const Coefficients& c, Scalar force) {
    direction_ = force > Scalar(0) ? Scalar(1) : Scalar(-1);
    farthest_ = -std::numeric_limits<Scalar>::max();
    before_ = swing_before_ = Scalar(0);
    lowest_ = highest_ = lowest_before_ = highest_before_ = Scalar(0);
    since_turn_ = half_period_before_ = c.longest;
    calm_down();
  }

  /// Nothing oscillates any more.
  [[gnu::noinline, gnu::cold]] void calm_down() {
    displacement_amplitude_ = force_amplitude_ = Scalar(0);
    energy_ = energy_before_ = Scalar(0);
    span_ = 0;
    unstable_ = false;
  }

  [[gnu::noinline, gnu::cold]] void turn(const Coefficients& c, Scalar along, Scalar force) {
    // The last turn was found while the direction was the other one, and has its sign.
    const Scalar swing = farthest_ + before_;
    const Scalar low = lowest_ < lowest_before_ ? lowest_ : lowest_before_;
    const Scalar high = highest_ > highest_before_ ? highest_ : highest_before_;
    const Scalar force_swing = high - low;
    if (!is_finite(swing) || !is_finite(force_swing)) {
      wake(c, direction_);
      return;
    }
    if (since_turn_ + half_period_before_ <= c.longest && force_swing >= c.force_swing) {
      displacement_amplitude_ = Scalar(0.25) * swing + Scalar(0.25) * swing_before_;
      force_amplitude_ = Scalar(0.5) * force_swing;
      judge(c);
    } else {
      calm_down();
    }
    before_ = farthest_;
    swing_before_ = swing;
    lowest_before_ = lowest_;
    highest_before_ = highest_;
    half_period_before_ = since_turn_;
    direction_ = -direction_;
    farthest_ = -along;
    lowest_ = highest_ = force;
    since_turn_ = 0;
  }

  void judge(const Coefficients& c) {
    energy_ += saturate(displacement_amplitude_ * force_amplitude_) * static_cast<Scalar>(since_turn_);
    span_ += since_turn_;
    if (span_ < c.settling) return;
    const Scalar energy = saturate(energy_) / static_cast<Scalar>(span_);
    const bool was_unstable = unstable_;
    unstable_ = energy_before_ > Scalar(0) && energy >= kept * energy_before_;
    if (unstable_ && !was_unstable) ++alarms_;
    if (unstable_ && (!was_unstable || force_amplitude_ > last_alarm_.force)) {
      last_alarm_ = {force_amplitude_, displacement_amplitude_,
                     c.rate / static_cast<Scalar>(since_turn_ + half_period_before_)};
    }
    energy_before_ = energy;
    energy_ = Scalar(0);
    span_ = 0;
  }

  // Displacements along the present direction, m; "before": at the last turn, or between the last two.
  Scalar direction_ = Scalar(1);
  Scalar farthest_{}, before_{}, swing_before_{};
  Scalar lowest_{}, highest_{}, lowest_before_{}, highest_before_{};  // N
  std::uint32_t awake_ = 0;                                           // samples left until it sleeps
  std::uint32_t since_turn_ = 0, half_period_before_ = 0;             // samples
  Scalar energy_{}, energy_before_{};  // 2 J: of this span, times samples; of the span before it, the mean
  std::uint32_t span_ = 0;             // samples
  Scalar displacement_amplitude_{}, force_amplitude_{};
  bool unstable_ = false;
  std::uint32_t alarms_ = 0;
  Alarm last_alarm_{};
};

}  // namespace kmax::control
