#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kmax::control {

/// Sine and cosine of one angle.
template <typename Scalar>
struct SineCosine {
  Scalar sine{};
  Scalar cosine{};
};

/// An angle as a binary fraction of a turn: 2^32 is one turn, so that sums, differences and whole multiples
/// (pole pairs) wrap by themselves. 0x40000000 is 90 degrees; read as a signed number it is the angle in
/// (-180, 180] degrees. A 16-bit angle is shifted up by 16.
using TurnFraction = std::uint32_t;

/// 2 pi / 2^32: radians for one unit of a TurnFraction.
template <typename Scalar>
inline constexpr Scalar radians_per_turn_fraction = static_cast<Scalar>(6.283185307179586476925286766559 /
                                                                        4294967296.0);

/// The table behind sine_cosine(): sine and cosine, side by side, of 512 equidistant angles of a turn; 4 KiB
/// in float. The two are read one after the other: beside each other they share a line of the flash's cache.
template <typename Scalar>
class SineTable {
 public:
  static constexpr std::size_t per_turn = 512;

  constexpr SineTable() {
    for (std::size_t k = 0; k < per_turn; ++k) {
      entries_[k].sine = static_cast<Scalar>(sine_of(k));
      entries_[k].cosine = static_cast<Scalar>(sine_of((k + per_turn / 4) % per_turn));
    }
  }
  constexpr const SineCosine<Scalar>& operator[](std::size_t entry) const { return entries_[entry]; }

 private:
  // Filled in by the compiler, in double whatever the target is. Octants are folded onto [0, 45] degrees: the
  // series is short there and the symmetries of the table hold to the bit.
  static constexpr double sine_of(std::size_t k) {
    constexpr std::size_t quarter = per_turn / 4;
    if (k >= 2 * quarter) return -sine_of(k - 2 * quarter);
    if (k > quarter) return sine_of(2 * quarter - k);
    constexpr double step = 6.283185307179586476925286766559 / static_cast<double>(per_turn);
    return k <= quarter / 2 ? series(static_cast<double>(k) * step, 1)
                            : series(static_cast<double>(quarter - k) * step, 0);
  }
  // x^first / first! - x^(first + 2) / (first + 2)! + ..: sine for 1, cosine for 0. 0.8^24 / 24! is 10^-26.
  static constexpr double series(double x, int first) {
    double sum = 0.0;
    for (int power = first + 22; power >= first; power -= 2) {
      sum = 1.0 - sum * x * x / static_cast<double>((power + 1) * (power + 2));
    }
    return first == 1 ? x * sum : sum;
  }

  std::array<SineCosine<Scalar>, per_turn> entries_{};
};

template <typename Scalar>
inline constexpr SineTable<Scalar> sine_table{};

/// An angle split into the nearest entry of the table and the rest, |rest| <= pi / 512.
template <typename Scalar>
struct TablePlace {
  std::size_t entry;
  Scalar rest;  ///< rad
};

template <typename Scalar>
constexpr TablePlace<Scalar> table_place(TurnFraction angle) {
  constexpr unsigned fraction_bits = 23;  // 32 - log2(512)
  // The low bits as a signed number; shifted up instead of being sign-extended, the factor makes up for it.
  constexpr Scalar scale =
      radians_per_turn_fraction<Scalar> / static_cast<Scalar>(1U << (32 - fraction_bits));
  return {static_cast<std::size_t>((angle + (1U << (fraction_bits - 1))) >> fraction_bits),
          static_cast<Scalar>(static_cast<std::int32_t>(angle << (32 - fraction_bits))) * scale};
}

/// Sine and cosine by the nearest table entry and the first terms of the sums' theorem for the rest r:
///     sin(a + r) = s + r (c - r/2 s),   cos(a + r) = c - r (s + r/2 c),   |r| <= pi / 512,
/// in double with two more terms of both series. Only additions and multiplications: every platform gives the
/// same bits. Exact at whole quarter turns.
///
/// Largest error, absolute, measured over 7 x 10^7 angles spread evenly over the turn: 8.9e-8 in float, 1.5
/// units in the last place of numbers from 1/2 to 1 (2^-24); 1.9e-16 in double. The test repeats it with
/// fewer angles. Cost and the other ways to it: docs/current_control.md.
template <typename Scalar>
SineCosine<Scalar> sine_cosine(TurnFraction angle) {
  const auto [entry, rest] = table_place<Scalar>(angle);
  const Scalar s = sine_table<Scalar>[entry].sine;
  const Scalar c = sine_table<Scalar>[entry].cosine;
  if constexpr (sizeof(Scalar) > sizeof(float)) {
    const Scalar square = rest * rest;
    const Scalar sine = rest * (Scalar(1) - square / Scalar(6) * (Scalar(1) - square / Scalar(20)));
    const Scalar versine =
        square / Scalar(2) * (Scalar(1) - square / Scalar(12) * (Scalar(1) - square / Scalar(30)));
    return {s + (sine * c - versine * s), c - (sine * s + versine * c)};
  } else {
    const Scalar half = rest * Scalar(0.5);
    return {s + rest * (c - half * s), c - rest * (s + half * c)};
  }
}

/// Likewise by the first term alone: sin(a + r) = s + r c, cos(a + r) = c - r s. Largest error 1.9e-5 of the
/// amplitude, which is too long by that between two entries; the direction is right to 1e-7 rad. For currents
/// and voltages, whose converter has steps of 2.4e-4. Six instructions less.
template <typename Scalar>
SineCosine<Scalar> sine_cosine_first_order(TurnFraction angle) {
  const auto [entry, rest] = table_place<Scalar>(angle);
  const Scalar s = sine_table<Scalar>[entry].sine;
  const Scalar c = sine_table<Scalar>[entry].cosine;
  return {s + rest * c, c - rest * s};
}

}  // namespace kmax::control
