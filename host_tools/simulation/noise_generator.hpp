#pragma once
// Random numbers that are the same on every machine and with every library for the same seed: whole-number
// arithmetic only (the distributions of <random> are not specified to the bit).
//
// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014): 64 bits of
// state, period 2^64. Cost: about 1 ns per draw.

#include <cstdint>

namespace kmax::simulation {

class NoiseGenerator {
 public:
  explicit constexpr NoiseGenerator(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  // From 0 up to, not including, 1.
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  // Mean 0, variance 1, nearly Gaussian: the sum of eight uniform numbers of 16 bits each, bounded to 4.9.
  // Its kurtosis is 2.85 instead of 3.
  constexpr double gaussian() {
    std::uint64_t sum = 0;
    for (int draw = 0; draw < 2; ++draw) {
      const std::uint64_t four = bits();
      for (int part = 0; part < 4; ++part) sum += (four >> (16 * part)) & 0xFFFFu;
    }
    constexpr double mean = 8 * 32767.5;
    constexpr double per_deviation = 1.0 / 53509.91992145008;  // sqrt(8 (2^32 - 1) / 12)
    return (static_cast<double>(sum) - mean) * per_deviation;
  }

 private:
  std::uint64_t state_;
};

}  // namespace kmax::simulation
