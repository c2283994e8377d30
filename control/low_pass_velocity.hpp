#pragma once

#include <cstdint>

#include "control/difference_velocity.hpp"

namespace kmax::control {

// Backward difference followed by a first-order low-pass, v += g (difference - v) with g = w T / (1 + w T)
// and w = 2 pi bandwidth: the backward-Euler image of w / (s + w), which is stable for every w T and needs no
// exponential. The quantum's share of the output falls to g quantum / period, at the price of a delay of 1/w
// seconds.
//
// bandwidth in Hz, > 0 (0 or less freezes the output); the -3 dB point is at `bandwidth` as long as it is far
// below the sampling rate. Other units as in difference_velocity.hpp. Cost: at most 41 Cortex-M4
// instructions.
template <typename Scalar>
class LowPassVelocity {
 public:
  struct Coefficients {
    typename DifferenceVelocity<Scalar>::Coefficients difference;
    Scalar gain = 0;
  };

  static constexpr Coefficients prepare(Scalar bandwidth, Scalar period, Scalar count_length) {
    constexpr auto two_pi = static_cast<Scalar>(6.283185307179586);
    const Scalar turn = bandwidth > 0 ? two_pi * bandwidth * period : Scalar{0};
    return {DifferenceVelocity<Scalar>::prepare(period, count_length), turn / (Scalar{1} + turn)};
  }

  void reset(std::int64_t count, Scalar velocity = 0) {
    difference_.reset(count);
    velocity_ = velocity;
  }

  Scalar update(const Coefficients& coefficients, std::int64_t count) {
    velocity_ += coefficients.gain * (difference_.update(coefficients.difference, count) - velocity_);
    return velocity_;
  }

 private:
  DifferenceVelocity<Scalar> difference_;
  Scalar velocity_ = 0;
};

}  // namespace kmax::control
