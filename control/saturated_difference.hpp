#pragma once

#include <cstdint>
#include <limits>

namespace kmax::control {

// to - from, limited to the range of int32. Positions are 64-bit counts, yet all that an interrupt computes
// from them (divisions, conversions to float) must be 32-bit: those have an instruction on a Cortex-M4, the
// 64-bit ones are library calls. Every pair of inputs is valid, also one whose difference does not fit 64
// bits.
constexpr std::int32_t saturated_difference(std::int64_t to, std::int64_t from) {
  constexpr std::int32_t largest = std::numeric_limits<std::int32_t>::max();
  constexpr std::int32_t smallest = std::numeric_limits<std::int32_t>::min();
  std::int64_t difference = 0;
  if (__builtin_sub_overflow(to, from, &difference)) return from < 0 ? largest : smallest;
  const auto narrow = static_cast<std::int32_t>(difference);
  if (narrow == difference) return narrow;
  return difference < 0 ? smallest : largest;
}

}  // namespace kmax::control
