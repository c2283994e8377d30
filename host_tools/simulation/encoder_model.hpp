#pragma once
// An ideal incremental encoder: true position in, counter value out. The counter is 32 bits wide and wraps,
// as a timer in encoder mode does; below zero it continues at 2^32 - 1. Nothing is added (noise, missing
// counts): a scene names sensor defects as parts of their own.

#include <cmath>
#include <cstdint>
#include <stdexcept>

#include <fmt/format.h>

namespace kmax::simulation {

class EncoderModel {
 public:
  // `count_length`: metres of handle travel per count, > 0. Throws std::invalid_argument.
  explicit EncoderModel(double count_length) : count_length_(count_length) {
    if (!std::isfinite(count_length) || !(count_length >= 1e-12) || count_length > 1.0) {
      throw std::invalid_argument(
          fmt::format("encoder count length = {} m: allowed is a number from 1e-12 to 1 m", count_length));
    }
  }

  // The count a lossless 64-bit counter would hold: floor(position / count length). The largest distance is
  // 2^53 counts, the last one that a double resolves. Throws std::domain_error beyond it and for NaN.
  std::int64_t extended_counts(double position) const {
    const double counts = std::floor(position / count_length_);
    if (!(std::abs(counts) <= 9007199254740992.0)) {
      throw std::domain_error(
          fmt::format("position {} m cannot be counted in steps of {} m", position, count_length_));
    }
    return static_cast<std::int64_t>(counts);
  }

  std::uint32_t counts(double position) const {
    return static_cast<std::uint32_t>(extended_counts(position));
  }

  double count_length() const { return count_length_; }

 private:
  double count_length_;
};

// Metres of handle travel per count of an encoder on the motor shaft. `counts_per_turn`: after four-fold
// decoding. `transmission`: handle metres per motor radian.
inline double count_length(double counts_per_turn, double transmission) {
  constexpr double two_pi = 6.283185307179586;
  return two_pi * transmission / counts_per_turn;
}

}  // namespace kmax::simulation
