#pragma once

#include <cstdint>
#include <limits>

#include "control/saturated_difference.hpp"

namespace kmax::control {

// Which multiple of the step stands for a count.
//   nearest     the nearest one; a tie (only possible with an even step) goes to the larger one, for negative
//               counts too. Every cell is therefore exactly `step` counts wide, the one around zero included:
//               step 4 maps -2..1 to 0; step 5 maps -2..2 to 0. Error: -step/2 < output - count <= step/2.
//   floor       the largest one that is not above the count: step 4 maps -4..-1 to -4. What a coarser encoder
//               does. Error: -step < output - count <= 0.
//   hysteresis  the output is kept until the count has left it by a full step, then it moves to the nearest
//               one. A count that dithers by less than a step never toggles the output. Error: less than a
//               step.
enum class Rounding : std::uint8_t { nearest = 0, floor = 1, hysteresis = 2 };

struct ResamplerConfig {
  std::int32_t step = 1;  // counts, 1 .. resampler_step_max; 1 = the encoder's own resolution
  Rounding rounding = Rounding::nearest;
};

inline constexpr std::int32_t resampler_step_max = std::int32_t{1} << 30;

// The step, in counts, that comes nearest to a requested resolution: resolution / count_length, rounded to
// the nearest whole number (halves up), at least 1, at most resampler_step_max. Resolution 0, a negative one,
// or a count length that is not positive give 1. Both in metres of handle travel. Outside the interrupt only
// (double division).
constexpr std::int32_t resampler_step(double resolution, double count_length) {
  if (!(resolution > 0.0) || !(count_length > 0.0)) return 1;
  const double counts = resolution / count_length + 0.5;
  if (!(counts >= 2.0)) return 1;
  if (counts >= static_cast<double>(resampler_step_max)) return resampler_step_max;
  return static_cast<std::int32_t>(counts);
}

// Spatial re-quantization with an unchanged sampling period: "re-sampling" of the paper on position
// resolution and stability (section 3), by which one device shows the behaviour of a coarser encoder. Integer
// in, integer out, exact; the output is always a multiple of the step, and the grid starts at count 0
// whatever happened before.
//
// The interrupt path has no 64-bit division. The last output is itself a multiple of the step close to the
// next count, so it serves as the anchor: only the 32-bit distance from it is divided (one SDIV). prepare()
// supplies the first anchor of each grid; the object takes it over when the step of the coefficients differs
// from the one it has been working with, and then the first sample goes to the nearest multiple in the
// hysteresis mode too. Coefficients with the same step share a grid, so a change of rounding alone keeps the
// held output.
//
// Precondition for the exact value at every sample: the count moves by less than 2^31 between two samples,
// and by less than 2^31 between the `anchor_near` given to prepare() and the first sample of the new step (10
// m of travel at 0.1 um is 10^8 counts, 20 times less). A longer jump is followed at 2^31 counts per sample:
// the output stays a multiple of the step throughout and is exact again once it has caught up. |count| must
// stay below 2^62.
//
// Cost: 26 Cortex-M4 instructions, 2 of them loads of 64 bits and one a division; 11 at a step of 1. No
// failure.
class Resampler {
 public:
  struct Coefficients {
    std::int64_t anchor = 0;  // a multiple of step
    std::int32_t step = 1;
    std::int32_t largest_rounded_down = 0;  // remainders above this one go up
    Rounding rounding = Rounding::nearest;
  };

  // Outside the interrupt. A step outside 1 .. resampler_step_max is taken as the nearer limit.
  static constexpr Coefficients prepare(const ResamplerConfig& config, std::int64_t anchor_near) {
    Coefficients coefficients;
    coefficients.step = config.step < 1                    ? 1
                        : config.step > resampler_step_max ? resampler_step_max
                                                           : config.step;
    coefficients.anchor = anchor_near / coefficients.step * coefficients.step;
    coefficients.rounding = config.rounding;
    coefficients.largest_rounded_down =
        config.rounding == Rounding::floor ? coefficients.step : (coefficients.step - 1) / 2;
    return coefficients;
  }

  // Forgets the grid: the next sample starts from the anchor of its coefficients.
  void reset() { step_ = 0; }

  struct Sample {
    std::int64_t count = 0;  // a multiple of the step
    std::int32_t steps = 0;  // by how many steps it differs from the one before
  };

  // `steps` of the first sample of a grid is without meaning.
  Sample sample(const Coefficients& coefficients, std::int64_t count) {
    if (coefficients.step != step_) [[unlikely]] {
      step_ = coefficients.step;
      held_ = coefficients.anchor;
      return {follow(coefficients, count), 0};
    }
    const auto difference =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(count) - static_cast<std::uint64_t>(held_));
    auto distance = static_cast<std::int32_t>(difference);
    if (distance != difference) [[unlikely]] {
      distance = difference < 0 ? std::numeric_limits<std::int32_t>::min()
                                : std::numeric_limits<std::int32_t>::max();
      count = held_ + distance;
    }
    // On the encoder's own grid every count is a step, however it is rounded.
    if (coefficients.step == 1) [[likely]] {
      held_ = count;
      return {count, distance};
    }
    const std::int32_t quotient = distance / coefficients.step;
    if (quotient == 0 && coefficients.rounding == Rounding::hysteresis) return {held_, 0};
    const Rounded rounded = round(coefficients, distance, quotient);
    held_ = count - rounded.rest;
    return {held_, rounded.steps};
  }

  std::int64_t update(const Coefficients& coefficients, std::int64_t count) {
    return sample(coefficients, count).count;
  }

 private:
  struct Rounded {
    std::int32_t steps = 0;
    std::int32_t rest = 0;  // what the distance exceeds this many steps by
  };
  static Rounded round(const Coefficients& coefficients, std::int32_t distance, std::int32_t quotient) {
    const std::int32_t remainder = distance - quotient * coefficients.step;
    const std::int32_t below = remainder >> 31;  // -1: the quotient has been rounded up
    const std::int32_t rest = remainder + (coefficients.step & below);
    const std::int32_t up = (coefficients.largest_rounded_down - rest) >> 31;  // -1: it is rounded up
    return {quotient + below - up, rest - (coefficients.step & up)};
  }

  [[gnu::noinline, gnu::cold]] std::int64_t follow(const Coefficients& coefficients, std::int64_t count) {
    const std::int32_t distance = count_difference(count, held_);
    // Two additions: distance less its rest may leave the int32 range.
    held_ += distance;
    held_ -= round(coefficients, distance, distance / coefficients.step).rest;
    return held_;
  }

  std::int64_t held_ = 0;  // the last output, a multiple of step_
  std::int32_t step_ = 0;  // 0: no grid yet
};

}  // namespace kmax::control
