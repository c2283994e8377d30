#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include "control/finite.hpp"

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
  sum,           ///< the measured currents do not add up to zero
};

/// What the sum of the three currents that are given is.
enum class PhaseSum : std::uint8_t {
  measured,  ///< every current that can flow has its own sensor
  implied,   ///< one of them was worked out from the others: always zero
};

/// Looks at every current sample for what a motor cable does when it breaks, and a sensor when it fails.
///
/// Open phase: the reference asks a phase for more than `present`, and less than `absent` is measured in it.
/// If the sample before carried more than `present` the same way, the current has vanished within one sample,
/// which no winding does by itself, and the verdict falls at once. If the current never came, the verdict
/// waits for `patience` samples: five time constants of the current loop, at least 1 ms. Neither is judged
/// while `slow` is false: a fast motor's back-EMF may hold the current down, and a glitch of the encoder,
/// which looks like speed, makes the feed-forward throw the current about. present = max(0.25 A, 5 % of
/// current_limit), absent = present / 3: below that a phase can open unnoticed.
///
/// Sum: |a + b + c| above 10 % of current_limit plus 0.25 A in more than `patience` samples in a row, at any
/// speed. Current then leaks to ground or the supply, or a sensor shows what does not flow. The 10 % leave
/// room for sensors that differ by 6 % and have settled to 1.3 %, also above the limit, the 0.25 A for
/// converter steps and what is left of offsets, which must be followed as they drift. It says something where
/// every conductor that is driven has a sensor: give a DC motor on legs B and C as {0, b, c}, three sensors
/// as they are. Where the third is worked out, {-(b + c), b, c}, the sum is zero and this never speaks:
/// PhaseSum::implied leaves it out.
///
/// A NaN counts as over-current. Magnitudes are compared as the integers that their bits make, sign off: the
/// same order, a NaN above infinity, and fewer instructions. Cost, executed on a Cortex-M4F in a good sample:
/// three sensors 51 instructions at most, sum implied 45, a DC motor 43 (the constant 0 falls away when
/// inlined).
template <typename Scalar>
class PhaseWatch {
 public:
  struct Coefficients {
    Scalar over_current{}, present{}, absent{}, unbalanced{};  // A, >= 0
    std::uint32_t patience = 20;
  };

  static constexpr Coefficients prepare(const PhaseWatchConfig<Scalar>& config) {
    Coefficients c;
    // A limit that is no number, or below 0, lets no current pass.
    const Scalar over_current = config.over_current_factor * config.current_limit;
    c.over_current = std::max(Scalar(0), over_current);
    const Scalar share = Scalar(0.05) * config.current_limit;
    c.present = std::max(Scalar(0.25), share);
    c.absent = c.present / Scalar(3);
    const Scalar tenth = Scalar(0.1) * config.current_limit;
    c.unbalanced = Scalar(0.25) + std::max(Scalar(0), tenth);
    const Scalar samples = Scalar(5) * config.rate / config.bandwidth;
    const Scalar least = config.rate / Scalar(1000);
    const Scalar most = Scalar(1e9);
    c.patience = static_cast<std::uint32_t>(std::clamp(samples, least, most));
    return c;
  }

  void reset() {
    before_ = {};
    starved_ = unbalanced_ = 0;
  }

  /// `sum` says whether the sum can say anything; implied saves 9 instructions.
  template <PhaseSum sum = PhaseSum::measured>
  [[gnu::always_inline]] PhaseCondition update(const Coefficients& c, const PhaseCurrents<Scalar>& measured,
                                               const PhaseCurrents<Scalar>& reference, bool slow) {
    const Bits a = bits(measured.a), b = bits(measured.b), third = bits(measured.c);
    const auto most = std::bit_cast<Bits>(c.over_current);
    if (a > most || b > most || third > most) [[unlikely]]
      return PhaseCondition::over_current;
    const auto present = std::bit_cast<Bits>(c.present), absent = std::bit_cast<Bits>(c.absent);
    bool doubtful = (bits(reference.a) > present && a < absent) ||
                    (bits(reference.b) > present && b < absent) ||
                    (bits(reference.c) > present && third < absent);
    if constexpr (sum == PhaseSum::measured) {
      doubtful = doubtful || magnitude(measured.a + measured.b + measured.c) > c.unbalanced;
    }
    if (doubtful) [[unlikely]]
      return judge(c, measured, reference, slow);
    before_ = measured;
    starved_ = unbalanced_ = 0;
    return PhaseCondition::good;
  }

 private:
  using Bits = std::conditional_t<sizeof(Scalar) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;
  static_assert(sizeof(Bits) == sizeof(Scalar));
  static constexpr unsigned starving = 1, vanished = 2;

  static constexpr Bits bits(Scalar value) {
    return std::bit_cast<Bits>(value) & ~(Bits{1} << (8 * sizeof(Bits) - 1));
  }

  // By value: in the good sample the currents then stay in registers.
  [[gnu::noinline, gnu::cold]] PhaseCondition judge(const Coefficients& c, PhaseCurrents<Scalar> measured,
                                                    PhaseCurrents<Scalar> reference, bool slow) {
    const unsigned missing = missing_bit(c, measured.a, reference.a, before_.a) |
                             missing_bit(c, measured.b, reference.b, before_.b) |
                             missing_bit(c, measured.c, reference.c, before_.c);
    before_ = measured;
    if ((missing & vanished) != 0 && slow) return PhaseCondition::open;
    starved_ = missing != 0 && slow ? starved_ + 1 : 0;
    const bool balanced = magnitude(measured.a + measured.b + measured.c) <= c.unbalanced;
    unbalanced_ = balanced ? 0 : unbalanced_ + 1;
    if (starved_ > c.patience) return PhaseCondition::open;
    return unbalanced_ > c.patience ? PhaseCondition::sum : PhaseCondition::good;
  }

  static unsigned missing_bit(const Coefficients& c, Scalar measured, Scalar reference, Scalar before) {
    if (magnitude(reference) <= c.present || magnitude(measured) >= c.absent) return 0;
    // On its way through zero to the other side a current may be caught at any value.
    return before * reference > Scalar(0) && magnitude(before) > c.present ? vanished : starving;
  }

  PhaseCurrents<Scalar> before_{};
  std::uint32_t starved_ = 0;
  std::uint32_t unbalanced_ = 0;
};

}  // namespace kmax::control
