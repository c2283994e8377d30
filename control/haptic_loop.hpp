#pragma once

#include <cstdint>
#include <limits>

#include "control/damper_velocity.hpp"
#include "control/finite.hpp"
#include "control/force_limiter.hpp"
#include "control/instability_detector.hpp"
#include "control/interference.hpp"
#include "control/resampler.hpp"
#include "control/velocity_estimator.hpp"
#include "control/wall_law.hpp"
#include "control/wall_softening.hpp"

namespace kmax::control {

/// What is done about a wall that oscillates under the hand; each does what the one before it does and more.
/// The numbers are those of instability.action.
enum class InstabilityAction : std::uint8_t {
  off = 0,     ///< it is not looked for
  warn = 1,    ///< it is said
  soften = 2,  ///< the wall's force comes down until it ends, and stays down
  trip = 3,    ///< no force, and a fault
};

enum class HapticFault : std::uint8_t { none, not_finite, over_speed, unstable };

/// All that one axis' haptic rendering is set by, in SI units. Positions are double: this struct is made
/// and read outside the interrupt only, and a surface 10 m away must keep its place to the count.
template <typename Scalar>
struct HapticLoopConfig {
  double count_length = 1e-6;        ///< m per encoder count, > 0
  double wall_position = 0.0;        ///< m
  std::int32_t wall_side = 1;        ///< +1 or -1: free space is on this side, the wall pushes towards it
  double position_resolution = 0.0;  ///< m, 0: the encoder's own
  Rounding position_rounding = Rounding::nearest;
  VelocityEstimatorConfig<Scalar> velocity;
  std::int32_t damping_window = 0;  ///< samples that the wall's damper differences over; 0: it has `velocity`
  WallLawConfig<Scalar> wall;
  InterferenceConfig<Scalar> interference;
  ForceLimiterConfig<Scalar> force;
  Scalar velocity_limit = Scalar(0);  ///< m/s, trip level; 0: none
  InstabilityAction instability_action = InstabilityAction::off;
  InstabilityDetectorConfig<Scalar> instability;  ///< but for its rate
  WallSofteningConfig<Scalar> softening;
  double tick_rate = 20000.0;  ///< Hz, calls of tick() per second
  std::uint32_t divider = 1;   ///< ticks per haptic sample, >= 1
};

/// From encoder count to force: the heart of the house, one axis.
///
///   count -> Resampler -> position, VelocityEstimator -> WallLaw + Interference -> WallSoftening
///         -> ForceLimiter -> force;    count, force -> InstabilityDetector -> WallSoftening
///
/// Called at every tick; the haptic part runs on every divider-th one and its force is held in between
/// (a zero-order hold, as in both papers). The position stays an integer until the distance to the wall
/// has been taken: the surface is held as a whole count and a fraction below one, so the penetration is
/// exact to the count wherever the wall is (as long as it is itself below 2^24 counts, in float; a distance
/// beyond 2^31 counts is taken as that).
///
/// Either tick() renders the wall, or follow() makes the force that it is given; which one may change from
/// tick to tick. Limits, soft start and faults are the same.
///
/// A value that is not finite anywhere gives zero force and `not_finite`; a velocity beyond the limit
/// gives zero force and `over_speed`; an oscillation, where the action is `trip`, gives zero force and
/// `unstable`. Where FOAW takes every second sample its velocity, and with it `over_speed`, may be one sample
/// late, and a jump counts over both. Faults are reported on every tick until the next haptic sample; to
/// latch them is the axis' business. While not enabled, everything is still estimated and evaluated, so that
/// arming starts from a settled estimator, but the force is zero and the soft start is wound back.
///
/// The detector sees the encoder's own counts from where the loop was enabled, since a coarser resolution is
/// the wall's and not the handle's motion, and a wall that is moved moves no handle; and the force after all
/// limits. It looks at every sample up to 10 kHz; beyond that at every fourth, which is one that FOAW leaves
/// out: no wall makes what a hand holds oscillate so fast that it would miss a turn. It looks on in tick()
/// only, while enabled. What has been softened stays so until the loop is not enabled, or reset; alarms are
/// counted until they are forgotten.
///
/// No heap, no libm, no virtual call, no loop beyond the velocity estimator's window.
template <typename Scalar>
class HapticLoop {
 public:
  struct Coefficients {
    std::int64_t wall_count = 0;  ///< whole counts of the surface, rounded down
    Scalar wall_fraction{};       ///< counts, 0 <= fraction < 1
    Scalar count_length{};        ///< m
    Scalar
        velocity_per_count{};  ///< m/s that one count per tick is, for whoever follows the counts themselves
    Scalar side{};             ///< +1 or -1
    Scalar velocity_limit{};   ///< m/s; the largest number: none
    std::uint32_t divider = 1;
    Resampler::Coefficients resampler{};
    typename VelocityEstimator<Scalar>::Coefficients velocity{};
    bool damper_has_its_own = false;  ///< velocity
    typename DamperVelocity<Scalar>::Coefficients damper{};
    typename WallLaw<Scalar>::Coefficients wall{};
    typename Interference<Scalar>::Coefficients interference{};
    typename ForceLimiter<Scalar>::Coefficients force{};
    InstabilityAction instability_action = InstabilityAction::off;
    std::uint32_t watch_mask = 0;  ///< the detector looks at samples whose number has all of these bits
    typename InstabilityDetector<Scalar>::Coefficients instability{};
    typename WallSoftening<Scalar>::Coefficients softening{};
  };

  struct Output {
    Scalar force{};             ///< N along +x, what the device is asked for
    Scalar tangential_force{};  ///< N along the surface (parallel interference), for a law over several axes
    std::int64_t position{};    ///< counts, re-sampled
    Scalar outside_distance{};  ///< m, > 0 in free space
    Scalar velocity{};          ///< m/s along +x
    Scalar magnetic_force{};    ///< N, outwards, before softening
    Scalar magnetic_coefficient{};  ///< N
    bool limited = false;           ///< force.limit took something away
    bool slew_limited = false;
    bool ramping = false;  ///< soft start under way
    HapticFault fault = HapticFault::none;
    bool inside = false;
    bool unstable = false;    ///< the wall oscillates under the hand
    bool new_sample = false;  ///< this tick computed; false: the previous sample is held
  };

  /// Outside the interrupt path. `count_near`: a recent count, the resampler's anchor.
  static Coefficients prepare(const HapticLoopConfig<Scalar>& config, std::int64_t count_near);

  /// Start afresh, as after power-up: no velocity, no held force, soft start wound back. Needed when the
  /// scale or the origin of the counts has changed. `samples`: what samples() goes on from.
  void reset(std::uint32_t samples = 0) {
    resampler_.reset();
    damper_.forget();
    settled_ = false;
    wall_.reset();
    interference_.reset();
    limiter_.reset();
    detector_.reset();
    softening_.reset();
    ticks_until_sample_ = 0;
    samples_ = samples;
    held_ = Output{};
  }

  /// One tick of a rendered wall. `added`: N along +x that comes from elsewhere, limited with the wall's
  /// force.
  [[gnu::flatten]] const Output& tick(const Coefficients& c, std::int64_t count, bool enabled,
                                      Scalar added = Scalar(0)) {
    if (!sample_is_due(c)) return hold(enabled);
    counted_ = static_cast<std::uint32_t>(count);
    const Motion motion = observe(c, count);
    const Scalar outwards = c.side * motion.velocity;
    const auto wall = wall_.update(c.wall, motion.outside_distance, outwards, damper_velocity(c, outwards));
    const auto disturbance = interference_.update(c.interference, wall.inside);
    show(wall, disturbance);
    const Scalar outward = softening_.factor() * (wall.force + disturbance.normal);
    Scalar requested = c.side * outward + added;
    if (!is_sound(c, requested)) [[unlikely]]
      requested = without_overflow(c, outward, added);
    if (!limit(c, requested, enabled)) [[unlikely]]
      return held_;
    if (c.instability_action == InstabilityAction::off) [[unlikely]] {
      held_.unstable = false;
    } else if (watch_is_due(c)) {
      watch(c);
    }
    return held_;
  }

  /// One tick without a wall: `force` (N along +x) is what is asked for.
  [[gnu::noinline]] const Output& follow(const Coefficients& c, std::int64_t count, bool enabled,
                                         Scalar force) {
    if (!sample_is_due(c)) return hold(enabled);
    const Motion motion = observe(c, count);
    show({.inside = !(motion.outside_distance > Scalar(0))}, {});
    detector_.reset();
    held_.unstable = false;
    if (!is_sound(c, force)) [[unlikely]]
      name_fault(force);
    limit(c, force, enabled);
    return held_;
  }

  /// 0 to 1: the share of the force that the soft start lets pass; 0 while not enabled.
  Scalar ramp() const { return limiter_.ramp(); }

  /// N, outwards: what papers call the background force, the field's force and the interference's F_B, in the
  /// last haptic sample of tick(), softened, before soft start and limits. Nothing but a simulated person
  /// asks for it, so it is worked out only then.
  Scalar background_force(const Coefficients& c) const {
    return softening_.factor() * (held_.magnetic_force + interference_.background(c.interference));
  }

  /// N/m: what the wall's spring has come to, before softening; its stiffness unless that grows. For a
  /// simulation; no board asks for it.
  Scalar present_stiffness(const Coefficients& c) const { return wall_.present_stiffness(c.wall); }

  /// 0 to 1: the factor on all of the wall's force; 1 while not enabled.
  Scalar softening() const { return softening_.factor(); }

  const InstabilityDetector<Scalar>& detector() const { return detector_; }
  void forget_alarms() { detector_.forget_alarms(); }

  /// Haptic samples so far; wraps at 2^32.
  std::uint32_t samples() const { return samples_; }

  /// What the last tick() or follow() gave.
  const Output& output() const { return held_; }

  /// Ticks from now that would only hold what the last one gave.
  std::uint32_t held_ticks() const { return ticks_until_sample_; }
  /// In place of `ticks` > 0 calls of tick() or follow() that would only hold, with `enabled` as in the last
  /// one. Beyond held_ticks() samples are left out. For a simulation; no board calls it or pays for it.
  void pass_held(std::uint32_t ticks) {
    ticks_until_sample_ -= ticks < ticks_until_sample_ ? ticks : ticks_until_sample_;
    held_.new_sample = false;
  }

  /// Distance of a count from the surface, m, > 0 in free space.
  static Scalar outside_distance(const Coefficients& c, std::int64_t position) {
    const std::int64_t difference = position - c.wall_count;
    auto whole = static_cast<std::int32_t>(difference);
    if (whole != difference) [[unlikely]]
      whole = difference < 0 ? INT32_MIN : INT32_MAX;
    const Scalar counts = static_cast<Scalar>(whole) - c.wall_fraction;
    return c.side * (counts * c.count_length);
  }

 private:
  /// s; where samples come faster, the detector looks at every fourth, one that FOAW leaves out.
  static constexpr auto shortest_look = static_cast<Scalar>(foaw_shortest_period);

  struct Motion {
    Scalar velocity{};          ///< m/s along +x
    Scalar outside_distance{};  ///< m, > 0 in free space
  };

  bool sample_is_due(const Coefficients& c) {
    if (ticks_until_sample_ != 0) {
      --ticks_until_sample_;
      return false;
    }
    ticks_until_sample_ = c.divider - 1;
    ++samples_;
    return true;
  }

  /// Between two samples.
  const Output& hold(bool enabled) {
    held_.new_sample = false;
    if (!enabled) release();
    return held_;
  }

  /// Where the handle is, and how fast.
  Motion observe(const Coefficients& c, std::int64_t count) {
    const Resampler::Sample sample = resampler_.sample(c.resampler, count);
    if (!settled_) {
      velocity_.reset(sample.count);
      settled_ = true;
    }
    held_.new_sample = true;
    held_.fault = HapticFault::none;
    held_.position = sample.count;
    held_.velocity = velocity_.update(c.velocity, sample, samples_);
    held_.outside_distance = outside_distance(c, sample.count);
    return {held_.velocity, held_.outside_distance};
  }

  /// m/s outwards.
  Scalar damper_velocity(const Coefficients& c, Scalar outwards) {
    if (!c.damper_has_its_own) [[likely]]
      return outwards;
    // What it saw before it was switched off is not its window.
    if (damper_saw_ + 1 != samples_) damper_.forget();
    damper_saw_ = samples_;
    return c.side * damper_.update(c.damper, held_.position);
  }

  void show(const typename WallLaw<Scalar>::Output& wall,
            const typename Interference<Scalar>::Output& disturbance) {
    held_.inside = wall.inside;
    held_.magnetic_force = wall.magnetic_force;
    held_.magnetic_coefficient = wall.magnetic_coefficient;
    held_.tangential_force = disturbance.tangential;
  }

  /// Nothing keeps the force from being given. A velocity within the limit is finite, since the limit is.
  bool is_sound(const Coefficients& c, Scalar requested) const {
    return magnitude(held_.velocity) <= c.velocity_limit && are_finite(requested, held_.outside_distance);
  }

  /// The sum of an outward force and one along +x where something is not sound: what overflows is brought
  /// back to the largest number, and anything else is a fault.
  [[gnu::noinline, gnu::cold]] Scalar without_overflow(const Coefficients& c, Scalar outward, Scalar added) {
    const Scalar requested = saturate(c.side * saturate(outward) + added);
    if (!is_sound(c, requested)) name_fault(requested);
    return requested;
  }

  /// From what is asked for to what the device gets. False: it gets nothing.
  bool limit(const Coefficients& c, Scalar requested, bool enabled) {
    if (!enabled || held_.fault != HapticFault::none) [[unlikely]] {
      release();
      return false;
    }
    const auto limited = limiter_.update_finite(c.force, requested);
    held_.force = limited.force;
    held_.limited = limited.limited;
    held_.slew_limited = limited.slew_limited;
    held_.ramping = limited.ramping;
    return true;
  }

  [[gnu::noinline, gnu::cold]] void name_fault(Scalar requested) {
    const bool finite =
        is_finite(held_.velocity) && is_finite(held_.outside_distance) && is_finite(requested);
    held_.fault = finite ? HapticFault::over_speed : HapticFault::not_finite;
  }

  bool watch_is_due(const Coefficients& c) const { return (c.watch_mask & ~samples_) == 0; }

  /// Whether the wall oscillates under the hand, with what is to be done about it. A function of its own: it
  /// would take registers from the velocity estimator.
  [[gnu::noinline]] void watch(const Coefficients& c) {
    const auto moved = static_cast<std::int32_t>(counted_ - watched_from_);
    held_.unstable =
        detector_.update(c.instability, static_cast<Scalar>(moved) * c.count_length, held_.force);
    if (held_.unstable) [[unlikely]]
      act_on_instability(c);
  }

  [[gnu::noinline, gnu::cold]] void act_on_instability(const Coefficients& c) {
    if (c.instability_action == InstabilityAction::soften) softening_.update(c.softening, true);
    if (c.instability_action == InstabilityAction::trip) {
      release();
      held_.unstable = true;
      held_.fault = HapticFault::unstable;
    }
  }

  /// No force, and the soft start is wound back.
  void release() {
    limiter_.reset();
    softening_.reset();
    detector_.reset();
    watched_from_ = counted_;
    held_.unstable = false;
    held_.force = Scalar(0);
    held_.tangential_force = Scalar(0);
    held_.limited = held_.slew_limited = held_.ramping = false;
  }

  // The estimators' long windows come last: the core's shortest loads of floats reach 1 KiB.
  Output held_;
  Resampler resampler_;
  WallLaw<Scalar> wall_;
  Interference<Scalar> interference_;
  ForceLimiter<Scalar> limiter_;
  WallSoftening<Scalar> softening_;
  InstabilityDetector<Scalar> detector_;
  // Low words of counts: the last one, kept here so that it takes no registers, and the detector's origin.
  std::uint32_t counted_ = 0, watched_from_ = 0;
  std::uint32_t ticks_until_sample_ = 0;
  std::uint32_t samples_ = 0;
  bool settled_ = false;  // the velocity estimator has seen a position
  VelocityEstimator<Scalar> velocity_;
  DamperVelocity<Scalar> damper_;
  std::uint32_t damper_saw_ = 0;  // the number of its last sample
};

template <typename Scalar>
typename HapticLoop<Scalar>::Coefficients HapticLoop<Scalar>::prepare(const HapticLoopConfig<Scalar>& config,
                                                                      std::int64_t count_near) {
  Coefficients c;
  const auto period = static_cast<Scalar>(static_cast<double>(config.divider) / config.tick_rate);
  const double surface = config.wall_position / config.count_length;
  c.wall_count = static_cast<std::int64_t>(surface);
  if (static_cast<double>(c.wall_count) > surface) --c.wall_count;
  c.wall_fraction = static_cast<Scalar>(surface - static_cast<double>(c.wall_count));
  c.count_length = static_cast<Scalar>(config.count_length);
  c.velocity_per_count = static_cast<Scalar>(config.count_length * config.tick_rate);
  c.side = config.wall_side < 0 ? Scalar(-1) : Scalar(1);
  c.velocity_limit = config.velocity_limit > Scalar(0) ? saturate(config.velocity_limit)
                                                       : std::numeric_limits<Scalar>::max();
  c.divider = config.divider < 1 ? 1 : config.divider;

  const std::int32_t step = resampler_step(config.position_resolution, config.count_length);
  c.resampler = Resampler::prepare({step, config.position_rounding}, count_near);
  c.velocity = VelocityEstimator<Scalar>::prepare(config.velocity, period, c.count_length, step);
  c.damper_has_its_own = config.damping_window > 0;
  c.damper = DamperVelocity<Scalar>::prepare(config.damping_window, period, c.count_length, step);
  c.wall = WallLaw<Scalar>::prepare(config.wall, period);
  c.interference = Interference<Scalar>::prepare(config.interference, period);
  c.force = ForceLimiter<Scalar>::prepare(config.force, period);
  c.instability_action = config.instability_action;
  auto instability = config.instability;
  // Four is a power of two: one comparison of bits. The last of four is odd, so FOAW leaves it out.
  constexpr std::uint32_t samples_a_look = 4;
  const bool at_each = period >= shortest_look;
  c.watch_mask = at_each ? 0 : samples_a_look - 1;
  const Scalar look = at_each ? period : Scalar(samples_a_look) * period;
  instability.rate = Scalar(1) / look;
  c.instability = InstabilityDetector<Scalar>::prepare(instability);
  c.softening = WallSoftening<Scalar>::prepare(config.softening, look);
  return c;
}

}  // namespace kmax::control
