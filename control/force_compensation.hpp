#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "control/finite.hpp"
#include "control/sine_cosine.hpp"

namespace kmax::control {

/// What the device itself does to the handle, N along +x at the handle: the compensation adds the opposite.
template <typename Scalar>
struct ForceCompensationConfig {
  Scalar friction = Scalar(0);              ///< N, >= 0: Coulomb friction to make up for
  Scalar friction_velocity = Scalar(0.02);  ///< m/s, > 0: from here on all of it, below in proportion
  std::uint32_t cogging_periods = 0;        ///< per turn of the shaft; 0: no cogging
  Scalar cogging_cosine_1 = Scalar(0);      ///< N, of the cogging period's first harmonic
  Scalar cogging_sine_1 = Scalar(0);        ///< N
  Scalar cogging_cosine_2 = Scalar(0);      ///< N, of its second harmonic
  Scalar cogging_sine_2 = Scalar(0);        ///< N
  Scalar gravity_constant = Scalar(0);      ///< N
  Scalar gravity_cosine = Scalar(0);        ///< N, once per turn of the shaft
  Scalar gravity_sine = Scalar(0);          ///< N, once per turn of the shaft
  Scalar limit = Scalar(0);                 ///< N, bound on the sum; 0: all off
};

/// A force that makes the handle feel lighter: against friction, the motor's cogging, and gravity.
///
///   map             -(cogging at periods x shaft angle) - (gravity at the shaft angle)
///   share           friction, or what is left of limit beside the largest value of the map (>= 0), if less
///   friction part   +share x v / friction_velocity, bounded to +-share
///   result          map + friction part, bounded to +-limit
///
/// The map comes first because what it leaves is ripple, while friction that is left is a steady drag; and a
/// bound that cut into their sum would put the cogging back in wherever it is met.
///
/// Both parts of the map are tables of 64 entries over their period, filled in prepare(), with straight lines
/// between them: 0.12 % of a first harmonic's amplitude wrong, 0.48 % of a second's.
///
/// Why a handle that nobody touches cannot be set in motion by it. Let f be the real Coulomb friction (the
/// same standing and moving, or more standing), and limit < f.
///   1. At rest, friction holds against anything up to f. |result| <= limit < f for every input, so the
///      handle stays, whatever the map says and whatever velocity an encoder's jitter pretends: the proof
///      needs neither to be right.
///   2. Moving with v, the power of compensation and friction together is result v - f |v|
///      <= -(f - limit) |v| < 0: it always brakes. Over any closed cycle of path length s at least
///      (f - limit) s is lost; from kinetic energy E the handle comes to rest within E / (f - limit). Sign
///      errors of velocity or map, and any delay, are covered: only |result| enters.
///   3. If the device has cogging and gravity with the potential U (known to the map or not), the same holds
///      for kinetic energy + U. Point 1 then needs |dU/dx| + limit <= f. Where that is not so, a wrong map
///      (shifted by half a period, say) can make the handle slip out of a detent in which friction alone
///      would have held it; it comes to rest within a path of (U_start - U_lowest) / (f - limit). It is never
///      driven on and on.
/// limit >= f voids all three: choose a share of the identified friction that leaves room for how friction
/// changes (0.7 of it, not 0.99; warm grease loses a third). What the current loop adds by its own ripple is
/// not in `limit`.
///
/// friction_velocity: below it the friction part acts as a negative damper of friction / friction_velocity,
/// which the real friction outweighs, as said. It is felt as a buzz if one count of the encoder's jitter
/// makes the velocity estimate jump by much of it: 0.055 mm and FOAW at 20 kHz want 0.05 m/s and more.
///
/// Anything that is not finite, in the configuration or as velocity, gives 0; so does a limit that is not
/// finite or not above 0. Cost, executed on a Cortex-M4F: 46 to 53 instructions, 6 when off. Memory of the
/// coefficients: 536 bytes in float.
template <typename Scalar>
class ForceCompensation {
 public:
  static constexpr std::size_t table_size = 64;
  /// The first entry comes again at the end: no entry is the last one.
  using Table = std::array<Scalar, table_size + 1>;

  struct Coefficients {
    Scalar limit{};           ///< N, >= 0
    Scalar friction{};        ///< N, >= 0, the share
    Scalar friction_slope{};  ///< N s/m
    std::uint32_t cogging_periods = 0;
    Table cogging{};  ///< N to add, over one cogging period
    Table gravity{};  ///< N to add, over one turn of the shaft
  };

  /// Outside the interrupt: about 7000 instructions.
  static Coefficients prepare(const ForceCompensationConfig<Scalar>& config) {
    Coefficients c;
    if (!(config.limit > Scalar(0)) || !is_finite(config.limit) || !is_finite(config.friction)) return c;
    c.limit = config.limit;
    c.cogging_periods = config.cogging_periods;
    for (std::size_t k = 0; k <= table_size; ++k) {
      const TurnFraction angle = static_cast<TurnFraction>(k) << fraction_bits;
      const auto [sine, cosine] = sine_cosine<Scalar>(angle);
      c.gravity[k] = -(config.gravity_constant + config.gravity_cosine * cosine + config.gravity_sine * sine);
      if (config.cogging_periods == 0) continue;
      const auto [sine_2, cosine_2] = sine_cosine<Scalar>(angle + angle);
      c.cogging[k] = -(config.cogging_cosine_1 * cosine + config.cogging_sine_1 * sine +
                       config.cogging_cosine_2 * cosine_2 + config.cogging_sine_2 * sine_2);
    }
    const Scalar left = config.limit - largest(c.gravity) - largest(c.cogging);
    const Scalar share = std::min(config.friction, left);
    if (share > Scalar(0) && config.friction_velocity > Scalar(0)) {
      c.friction = share;
      c.friction_slope = share / config.friction_velocity;
    }
    return c;
  }

  /// N to add to the force along +x, |result| <= limit. `shaft_angle`: of the motor's shaft, 0 at position 0,
  /// growing with the position or against it as the configuration was identified. `velocity`: m/s.
  static Scalar update(const Coefficients& c, TurnFraction shaft_angle, Scalar velocity) {
    if (!(c.limit > Scalar(0))) return Scalar(0);
    const Scalar wanted = c.friction_slope * velocity;
    Scalar sum = magnitude(wanted) <= c.friction ? wanted : wanted < Scalar(0) ? -c.friction : c.friction;
    sum += wanted - wanted;  // 0, or a NaN for a velocity that is not finite
    sum += at(c.cogging, shaft_angle * c.cogging_periods) + at(c.gravity, shaft_angle);
    if (magnitude(sum) <= c.limit) [[likely]]
      return sum;
    if (!is_finite(sum)) return Scalar(0);
    return sum < Scalar(0) ? -c.limit : c.limit;
  }

 private:
  static constexpr unsigned index_bits = 6;
  static constexpr unsigned fraction_bits = 32 - index_bits;
  static_assert(table_size == std::size_t{1} << index_bits);

  static Scalar largest(const Table& table) {
    Scalar largest = Scalar(0);
    for (const Scalar entry : table) {
      if (magnitude(entry) > largest) largest = magnitude(entry);
    }
    return largest;
  }

  static Scalar at(const Table& table, TurnFraction angle) {
    const Scalar* const entry = &table[angle >> fraction_bits];
    const Scalar fraction = static_cast<Scalar>(angle << index_bits) * static_cast<Scalar>(0x1p-32);
    return entry[0] + fraction * (entry[1] - entry[0]);
  }
};

}  // namespace kmax::control
