#pragma once

#include <cstdint>
#include <limits>

#if defined(__ARM_FEATURE_DSP) && defined(__ARM_FEATURE_SAT)
#include <arm_acle.h>
#endif

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

// The same for two counts, |count| < 2^62: a third of the instructions (5 on a Cortex-M4), because the 64-bit
// difference cannot overflow then. Beyond that bound the result is some int32.
inline std::int32_t count_difference(std::int64_t to, std::int64_t from) {
  const auto difference =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
  const auto narrow = static_cast<std::int32_t>(difference);
  if (narrow == difference) [[likely]] {
    return narrow;
  }
  return difference < 0 ? std::numeric_limits<std::int32_t>::min() : std::numeric_limits<std::int32_t>::max();
}

// a + b, limited to the range of int32: QADD.
inline std::int32_t saturated_sum(std::int32_t a, std::int32_t b) {
#if defined(__ARM_FEATURE_DSP) && defined(__ARM_FEATURE_SAT)
  return __qadd(a, b);
#else
  const std::int64_t sum = std::int64_t{a} + b;
  const auto narrow = static_cast<std::int32_t>(sum);
  if (narrow == sum) return narrow;
  return sum < 0 ? std::numeric_limits<std::int32_t>::min() : std::numeric_limits<std::int32_t>::max();
#endif
}

// to - from, limited to [-8, 7]: QSUB and SSAT.
inline std::int32_t difference_to_4_bits(std::int32_t to, std::int32_t from) {
#if defined(__ARM_FEATURE_DSP) && defined(__ARM_FEATURE_SAT)
  return __ssat(__qsub(to, from), 4);
#else
  const std::int64_t difference = std::int64_t{to} - from;
  return difference < -8 ? -8 : difference > 7 ? 7 : static_cast<std::int32_t>(difference);
#endif
}

}  // namespace kmax::control
