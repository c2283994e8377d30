#pragma once

#include <cstdint>

#include "control/saturated_difference.hpp"

namespace kmax::control {

// Critically damped tracking loop (alpha-beta filter): a model that moves at constant velocity is corrected
// by the residual r between the count and its prediction,
//     position += alpha r,   velocity += beta r / T,
//     alpha = 1 - p^2,   beta = (1 - p)^2,   p = 1 / (1 + w T),
// which puts both poles of the error at z = p: no overshoot from the poles, no steady error on a ramp (unlike
// the first-order low-pass it does not lag a constant velocity), w = 2 pi bandwidth.
//
// The model's position is kept RELATIVE to the present count, and so stays small (a fraction of a count on a
// ramp): neither the distance from zero nor the running time costs precision.
//
// bandwidth in Hz, > 0 (0 or less freezes the output): frequency of the double pole. From true to estimated
// velocity the loop is w^2 / (s + w)^2 as long as w T is small: -3 dB at 0.64 of `bandwidth`, a delay of 2/w
// seconds at low frequency. period s, count_length m, output m/s. Every count is valid: the difference
// saturates to int32, so the output is finite. Cost: at most 41 Cortex-M4 instructions.
template <typename Scalar>
class TrackingVelocity {
 public:
  struct Coefficients {
    Scalar kept = 0;  // 1 - alpha
    Scalar beta = 0;
    Scalar scale = 0;       // m/s for one count per sample
    Scalar per_sample = 0;  // counts per sample for 1 m/s
  };

  static constexpr Coefficients prepare(Scalar bandwidth, Scalar period, Scalar count_length) {
    constexpr auto two_pi = static_cast<Scalar>(6.283185307179586);
    const Scalar turn = bandwidth > 0 ? two_pi * bandwidth * period : Scalar{0};
    const Scalar pole = Scalar{1} / (Scalar{1} + turn);
    const Scalar rest = turn / (Scalar{1} + turn);  // 1 - pole without the cancellation
    return {pole * pole, rest * rest, count_length / period, period / count_length};
  }

  void reset(std::int64_t count) {
    last_ = count;
    ahead_ = 0;
    velocity_ = 0;
  }

  // Starts on the count with a known velocity, m/s.
  void reset(const Coefficients& coefficients, std::int64_t count, Scalar velocity) {
    reset(count);
    velocity_ = velocity * coefficients.per_sample;
  }

  Scalar update(const Coefficients& coefficients, std::int64_t count) {
    const auto moved = static_cast<Scalar>(saturated_difference(count, last_));
    last_ = count;
    const Scalar predicted = ahead_ + (velocity_ - moved);  // prediction minus present count = -r
    ahead_ = coefficients.kept * predicted;
    velocity_ -= coefficients.beta * predicted;
    return velocity_ * coefficients.scale;
  }

 private:
  std::int64_t last_ = 0;
  Scalar ahead_ = 0;     // model's position minus present count, counts
  Scalar velocity_ = 0;  // counts per sample
};

}  // namespace kmax::control
