#pragma once

#include <cstdint>

#include "control/saturated_difference.hpp"

namespace kmax::control {

// Velocity as the backward difference of the count. No delay beyond half a sample, but one quantum of
// position appears as quantum / period: 0.055 mm at 500 Hz is 27.5 mm/s, 1 um at 20 kHz is 20 mm/s.
//
// Units: count_length in metres per count, > 0; period in seconds, > 0; output m/s. Every count is valid: the
// difference saturates to int32, so the output is finite. Cost: at most 37 Cortex-M4 instructions.
template <typename Scalar>
class DifferenceVelocity {
 public:
  struct Coefficients {
    Scalar scale = 0;  // m/s for one count per sample
  };

  static constexpr Coefficients prepare(Scalar period, Scalar count_length) {
    return {count_length / period};
  }

  void reset(std::int64_t count) { last_ = count; }

  Scalar update(const Coefficients& coefficients, std::int64_t count) {
    const std::int32_t moved = saturated_difference(count, last_);
    last_ = count;
    return static_cast<Scalar>(moved) * coefficients.scale;
  }

 private:
  std::int64_t last_ = 0;
};

}  // namespace kmax::control
