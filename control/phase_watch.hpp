#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include "control/finite.hpp"
#include "control/phase_currents.hpp"

namespace kmax::control {

template <typename Scalar>
struct PhaseWatchConfig {
  Scalar current_limit = Scalar(5);  ///< A, > 0: the largest current that is ever asked for
  Scalar over_current_factor = Scalar(1.5);
  Scalar bandwidth = Scalar(3000);  ///< rad/s of the current loop, > 0
  Scalar rate = Scalar(20000);      ///< looks per second
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

/// Looks at current samples for what a motor cable does when it breaks, and a sensor when it fails.
///
/// Over-current is asked of every sample, over_current(); the rest of some, at regular intervals, update():
///
/// Open phase: the reference asks a phase for more than `present`, and less than `absent` is measured in it,
/// for more than `patience` looks: five time constants of the current loop in whole looks, at least 1 ms. It
/// is not judged while `slow` is false: a fast motor's back-EMF may hold the current down, and a glitch of
/// the encoder, which looks like speed, makes the feed-forward throw the current about. present = max(0.25 A,
/// 5 % of current_limit), absent = present / 3: below that a phase can open unnoticed.
///
/// Sum: |a + b + c| above 10 % of current_limit plus 0.25 A in more than `patience` looks in a row, at any
/// speed. Current then leaks to ground or the supply, or a sensor shows what does not flow. The 10 % leave
/// room for sensors that differ by 6 % and have settled to 1.3 %, also above the limit, the 0.25 A for
/// converter steps and what is left of offsets, which must be followed as they drift. It says something where
/// every conductor that is driven has a sensor: give a DC motor on legs B and C as {0, b, c}, three sensors
/// as they are. Where the third is worked out, {-(b + c), b, c}, the sum is zero and this never speaks:
/// PhaseSum::implied leaves it out.
///
/// A NaN counts as over-current. Magnitudes are compared as the integers that their bits make, sign off: the
/// same order, a NaN above infinity, and fewer instructions. Cost, executed on a Cortex-M4F: over-current 13
/// instructions, a look that finds nothing 28.
template <typename Scalar>
class PhaseWatch {
 public:
  struct Coefficients {
    Scalar over_current{}, present{}, absent{}, unbalanced{};  // A, >= 0
    std::uint32_t patience = 20;                               // looks
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
    const Scalar looks = Scalar(5) * config.rate / config.bandwidth;
    const Scalar least = config.rate / Scalar(1000);
    const Scalar most = Scalar(1e9);
    c.patience = static_cast<std::uint32_t>(std::clamp(looks, least, most));
    return c;
  }

  void reset() { starved_ = unbalanced_ = 0; }

  /// Of this very sample; remembers nothing.
  [[gnu::always_inline]] static bool over_current(const Coefficients& c,
                                                  const PhaseCurrents<Scalar>& measured) {
    const auto most = std::bit_cast<Bits>(c.over_current);
    return bits(measured.a) > most || bits(measured.b) > most || bits(measured.c) > most;
  }

  /// At every look. `sum` says whether the sum can say anything.
  template <PhaseSum sum = PhaseSum::measured>
  [[gnu::always_inline]] PhaseCondition update(const Coefficients& c, const PhaseCurrents<Scalar>& measured,
                                               const PhaseCurrents<Scalar>& reference, bool slow) {
    const bool missing = is_missing(c, measured.a, reference.a) || is_missing(c, measured.b, reference.b) ||
                         is_missing(c, measured.c, reference.c);
    bool balanced = true;
    if constexpr (sum == PhaseSum::measured)
      balanced = magnitude(measured.a + measured.b + measured.c) <= c.unbalanced;
    if (missing || !balanced) [[unlikely]]
      return judge(c, missing && slow, balanced);
    reset();
    return PhaseCondition::good;
  }

 private:
  using Bits = std::conditional_t<sizeof(Scalar) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;
  static_assert(sizeof(Bits) == sizeof(Scalar));

  static constexpr Bits bits(Scalar value) {
    return std::bit_cast<Bits>(value) & ~(Bits{1} << (8 * sizeof(Bits) - 1));
  }
  static bool is_missing(const Coefficients& c, Scalar measured, Scalar reference) {
    return bits(reference) > std::bit_cast<Bits>(c.present) && bits(measured) < std::bit_cast<Bits>(c.absent);
  }

  [[gnu::noinline, gnu::cold]] PhaseCondition judge(const Coefficients& c, bool starved, bool balanced) {
    starved_ = starved ? starved_ + 1 : 0;
    unbalanced_ = balanced ? 0 : unbalanced_ + 1;
    if (starved_ > c.patience) return PhaseCondition::open;
    return unbalanced_ > c.patience ? PhaseCondition::sum : PhaseCondition::good;
  }

  std::uint32_t starved_ = 0, unbalanced_ = 0;  ///< looks in a row
};

}  // namespace kmax::control
