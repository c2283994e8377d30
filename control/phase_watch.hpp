#pragma once

#include <cstdint>

namespace kmax::control {

template <typename Scalar>
struct PhaseWatchConfig {
  Scalar current_limit = Scalar(5);  ///< A, > 0: the largest current that is ever asked for
  Scalar over_current_factor = Scalar(1.5);
  Scalar bandwidth = Scalar(3000);  ///< rad/s of the current loop, > 0
  Scalar rate = Scalar(20000);      ///< samples per second
};

/// Currents of the three motor phases, A, positive out of the bridge into the motor.
template <typename Scalar>
struct PhaseCurrents {
  Scalar a{}, b{}, c{};
};

enum class PhaseCondition : std::uint8_t {
  good,
  over_current,  ///< a measured current is beyond over_current_factor x current_limit
  open,          ///< a phase that should carry current carries none
};

/// Looks at every current sample for what a motor cable does when it breaks.
///
/// Open phase: the reference asks a phase for more than `present`, and less than `absent` is measured in it.
/// If the sample before carried more than `present` the same way, the current has vanished within one sample,
/// which no winding does by itself, and the verdict falls at once. If the current never came, the verdict
/// waits for `patience` samples: five time constants of the current loop, at least 1 ms. Neither is judged
/// while `slow` is false: a fast motor's back-EMF may hold the current down, and a glitch of the encoder,
/// which looks like speed, makes the feed-forward throw the current about. present = max(0.25 A, 5 % of
/// current_limit), absent = present / 3: below that a phase can open unnoticed.
///
/// A NaN counts as over-current. Cost: about 75 Cortex-M4F instructions.
template <typename Scalar>
class PhaseWatch {
 public:
  struct Coefficients {
    Scalar over_current{}, present{}, absent{};
    std::uint32_t patience = 20;
  };

  static constexpr Coefficients prepare(const PhaseWatchConfig<Scalar>& config) {
    Coefficients c;
    c.over_current = config.over_current_factor * config.current_limit;
    const Scalar share = Scalar(0.05) * config.current_limit;
    c.present = share > Scalar(0.25) ? share : Scalar(0.25);
    c.absent = c.present / Scalar(3);
    const Scalar samples = Scalar(5) * config.rate / config.bandwidth;
    const Scalar least = config.rate / Scalar(1000);
    const Scalar most = Scalar(1e9);
    c.patience = static_cast<std::uint32_t>(samples < least ? least : samples > most ? most : samples);
    return c;
  }

  void reset() {
    before_ = {};
    starved_ = 0;
  }

  PhaseCondition update(const Coefficients& c, const PhaseCurrents<Scalar>& measured,
                        const PhaseCurrents<Scalar>& reference, bool slow) {
    const bool within = magnitude(measured.a) <= c.over_current && magnitude(measured.b) <= c.over_current &&
                        magnitude(measured.c) <= c.over_current;
    if (!within) return PhaseCondition::over_current;
    const unsigned missing = missing_bit(c, measured.a, reference.a, before_.a) |
                             missing_bit(c, measured.b, reference.b, before_.b) |
                             missing_bit(c, measured.c, reference.c, before_.c);
    before_ = measured;
    if ((missing & vanished) != 0 && slow) return PhaseCondition::open;
    starved_ = missing != 0 && slow ? starved_ + 1 : 0;
    return starved_ > c.patience ? PhaseCondition::open : PhaseCondition::good;
  }

 private:
  static constexpr unsigned starving = 1, vanished = 2;

  static constexpr Scalar magnitude(Scalar value) { return value < Scalar(0) ? -value : value; }

  static unsigned missing_bit(const Coefficients& c, Scalar measured, Scalar reference, Scalar before) {
    if (magnitude(reference) <= c.present || magnitude(measured) >= c.absent) return 0;
    // On its way through zero to the other side a current may be caught at any value.
    return before * reference > Scalar(0) && magnitude(before) > c.present ? vanished : starving;
  }

  PhaseCurrents<Scalar> before_{};
  std::uint32_t starved_ = 0;
};

}  // namespace kmax::control
