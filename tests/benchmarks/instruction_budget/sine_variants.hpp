#pragma once

#include <cstdint>

#include "control/sine_cosine.hpp"

// Other ways to a sine and a cosine than those of control/, to be compared with them.
namespace kmax::instruction_budget {

/// The table's nearest entry alone.
inline control::SineCosine<float> sine_cosine_nearest(control::TurnFraction angle) {
  const auto place = control::table_place<float>(angle);
  return control::sine_table<float>[place.entry];
}

/// Without a table: the angle is folded onto [-45, 45] degrees, where
///     sin x = x + x^3 (s3 + s5 x^2 + s7 x^4),   cos x = 1 - x^2/2 + x^4 (c4 + c6 x^2 + c8 x^4)
/// with the coefficients of the smallest largest error (Remez' exchange over [0, pi/4]: 1.8e-9 and 9.5e-11
/// before rounding), and the quadrant decides which is which and about the signs.
inline control::SineCosine<float> sine_cosine_polynomial(control::TurnFraction angle) {
  const std::uint32_t quadrant = (angle + 0x20000000U) >> 30;
  const float x = static_cast<float>(static_cast<std::int32_t>(angle << 2)) *
                  (control::radians_per_turn_fraction<float> / 4);
  // angle << 2 is the rest within the quadrant, signed, at four times its size.
  const float square = x * x;
  const float sine =
      x + x * square * (-0.1666665066929431F + square * (0.0083319786631606F - square * 0.0001949563623789F));
  const float cosine =
      1.0F - square * 0.5F +
      square * square *
          (0.0416666468663864F + square * (-0.0013887367515731F + square * 0.0000244384515937F));
  const float first = (quadrant & 1U) != 0 ? cosine : sine;
  const float second = (quadrant & 1U) != 0 ? sine : cosine;
  return {(quadrant & 2U) != 0 ? -first : first, ((quadrant + 1U) & 2U) != 0 ? -second : second};
}

}  // namespace kmax::instruction_budget
