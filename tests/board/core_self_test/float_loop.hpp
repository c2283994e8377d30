#pragma once

#include <bit>
#include <cstdint>

// Two million steps in single precision whose every rounding reaches the result. The same source runs on the
// host; the final bits must be the same everywhere.

namespace kmax::core_self_test {

inline constexpr std::uint32_t float_loop_steps = 2'000'000;

inline std::uint32_t float_loop() {
  float x = 0.3F;
  float v = 0.0F;
  std::uint32_t word = 0;
  for (std::uint32_t step = 0; step < float_loop_steps; ++step) {
    const float force = -37.5F * x - 0.8F * v + 0.01F / (1.0F + x * x);
    v = v + force * 0.0001F;
    x = x + v * 0.0001F;
    const float size = __builtin_sqrtf(x * x + v * v);
    if (size > 10.0F) x = 0.3F;
    word = (word ^ std::bit_cast<std::uint32_t>(size)) * 16777619U;
  }
  return word ^ std::bit_cast<std::uint32_t>(x) ^ std::bit_cast<std::uint32_t>(v);
}

}  // namespace kmax::core_self_test
