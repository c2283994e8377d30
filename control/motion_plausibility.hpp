#pragma once

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct MotionPlausibilityConfig {
  Scalar mass = Scalar(0.05);        ///< kg at the handle, the rotor's share included, > 0
  Scalar hand_force = Scalar(5);     ///< N, >= 0: what a hand (and gravity, springs, cogging) may do
  Scalar tolerance = Scalar(0.02);   ///< J, > 0: unexplained energy that trips
  Scalar smoothing = Scalar(0.002);  ///< s, > 0: time constant against the encoder's steps
  Scalar memory = Scalar(0.3);  ///< s, > 0: 20 times as long as a stop keeps energy before it gives it back
};

/// Finds a motor that runs away: the handle gains energy that neither the force that acts nor any allowed
/// hand can have given it. The encoder slipped, the commutation offset is wrong, or a direction is reversed.
///
/// Energy, not acceleration, is compared: a stop throws the handle back against any force with an
/// acceleration that no motor reaches, but it gives back no more energy than it took.
///
///   m dv/dt = F + h + s      F force, |h| <= hand_force, s a stop or friction
///   R, the reserve:  dR = (F v + hand_force |v|) dt - d(m v^2 / 2),  R <= E,  trips at R < -tolerance
///   E = 5/4 of the largest kinetic energy of late: 5/4 m v^2 / 2, or what was that, times e^(-t / memory)
///
/// With |h| <= hand_force R never falls but by what a stop returns, and the stop has raised it by as much
/// before; E bounds what can be kept for that, so that no credit from long ago hides a run-away. Friction
/// and damping raise R. The fourth beyond the kinetic energy is for what F itself presses into the stop; it
/// and the tolerance suffice for any lossless stop stiffer than 2 F^2 / tolerance (1.1 N/mm at 3.3 N).
///
/// v and F both pass the same first-order low-pass (`smoothing`). It is linear, so what comes out obeys the
/// same equation with |h| still within hand_force: no error by delay, and the velocity may be the plain
/// difference of counts (0.055 mm at 20 kHz: 1.1 m/s a count, 28 mm/s after 2 ms: 0.02 mJ at 45 g). An
/// estimator that delays by t on its own costs up to |F| |v| t of the tolerance: 7 mJ at 3.3 N, 1 m/s, 2 ms.
/// A configured mass above the real one asks for (ratio - 1) x |F| of hand_force; one below it, and a hand
/// that moves along, only make the test milder.
///
/// Trips. With the force reversed, or turned by the electrical angle d so that F cos d is what acts, a
/// handle that nobody holds gains (|F| (1 - cos d) - friction - hand_force) J/m that are not explained. It
/// trips at most 3 x smoothing after it has run, since the fault, the way (m)
///     w = (17/16 tolerance + 5/4 kinetic energy of late) / (|F| (1 - cos d) - friction - hand_force)
/// which from rest takes sqrt(2 w mass / (|F cos d| - friction)). F = 3.3 N reversed, 0.05 kg, no friction,
/// the defaults: 13 mm, 20 ms + 6 ms, 520 ticks at 20 kHz. If hand_force >= 2 |F| any such motion could be a
/// hand's, and none trips: set it below. At d = 90 degrees no torque is made: such a handle does not run
/// away, and it trips only if it is moved against the force, and only with |F| > hand_force. A handle at rest
/// never trips: a hand or a stop may hold it.
///
/// Does not trip for anything within hand_force up to 3 m/s, rubber stops that give back 64 % of the energy
/// (or one lossless impact), a wall that oscillates, or an encoder that chatters: the property tests.
///
/// `force` is what really acts (from the measured torque-making current, or at least after every limit): a
/// force that is only asked for would be missed as energy. Where the axis is not driven call follow()
/// instead, and reset() when the counts get another origin.
///
/// An axis calls it at every eighth tick: the coarser a call, the finer the difference of counts, 0.14 m/s a
/// count above, and the later a trip, by 0.35 ms at most.
///
/// A NaN trips. Cost, executed on a Cortex-M4F: 47 instructions.
template <typename Scalar>
class MotionPlausibility {
 public:
  /// Energies are kept as 2 / mass times themselves, m2/s2, impulses as 1 / mass: fewer instructions.
  struct Coefficients {
    Scalar smoothing{};     ///< share of the difference, per call
    Scalar acceleration{};  ///< m/s for 1 N between calls: period / mass
    Scalar hand{};          ///< m/s for hand_force between calls
    Scalar returned{};      ///< of the kinetic energy, in E
    Scalar kept{};          ///< of E, per call
    Scalar floor{};         ///< m2/s2, E's least above the present energy: no denormal numbers
    Scalar lowest{};        ///< m2/s2, < 0: trips below
    Scalar half_mass{};     ///< kg
  };

  /// Outside the interrupt. `period`: s per call of update().
  static constexpr Coefficients prepare(const MotionPlausibilityConfig<Scalar>& config, Scalar period) {
    Coefficients c;
    c.smoothing = config.smoothing > period ? period / config.smoothing : Scalar(1);
    c.acceleration = period / config.mass;
    c.hand = config.hand_force * c.acceleration;
    c.returned = Scalar(1.25);
    c.kept = config.memory > period ? Scalar(1) - period / config.memory : Scalar(0);
    c.half_mass = Scalar(0.5) * config.mass;
    c.lowest = -config.tolerance / c.half_mass;
    c.floor = config.tolerance / c.half_mass / Scalar(16);
    return c;
  }

  /// As if at rest.
  void reset() { *this = {}; }

  /// A call in which the axis is not driven: follows the velocity and judges nothing, so that arming a
  /// handle on the move is no surprise. Takes a velocity that is not finite as 0.
  void follow(const Coefficients& c, Scalar velocity) {
    velocity_ += c.smoothing * (velocity - velocity_);
    energy_ = c.returned * velocity_ * velocity_;
    if (!is_finite(energy_)) velocity_ = energy_ = Scalar(0);
    gain_ = Scalar(0);
    reserve_ = energy_;
  }

  /// `force`: N along +x that acts, `velocity`: m/s, both means since the last call. True: implausible. To
  /// latch that is the caller's business.
  bool update(const Coefficients& c, Scalar force, Scalar velocity) {
    const Scalar before = velocity_;
    const Scalar step = c.smoothing * (velocity - before);
    velocity_ = before + step;
    gain_ += c.smoothing * (force * c.acceleration - gain_);
    const Scalar energy = c.returned * velocity_ * velocity_;
    const Scalar fading = energy_ * c.kept;
    energy_ = fading > energy ? fading : energy + c.floor;
    // (before + velocity_) x step is the change of energy exactly; force and hand act over the same way.
    const Scalar way = before + velocity_;
    const Scalar reserve = reserve_ + (way * (gain_ - step) + c.hand * magnitude(way));
    reserve_ = reserve > energy_ ? energy_ : reserve;
    return !(reserve_ >= c.lowest);
  }

  /// J: R, what could still be explained beyond the present motion.
  Scalar reserve(const Coefficients& c) const { return reserve_ * c.half_mass; }

 private:
  Scalar velocity_{};  // m/s, smoothed
  Scalar gain_{};      // m/s that the force gives between calls, smoothed
  Scalar energy_{};    // E
  Scalar reserve_{};   // R
};

}  // namespace kmax::control
