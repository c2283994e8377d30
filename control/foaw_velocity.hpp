#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "control/saturated_difference.hpp"

namespace kmax::control {

enum class FoawFit : std::uint8_t { best, end };

inline constexpr std::int32_t foaw_window_max = 16;

// First-order adaptive windowing: F. Janabi-Sharifi, V. Hayward, C.-S. J. Chen, "Discrete-time adaptive
// windowing for velocity estimation", IEEE Trans. Control Systems Technology 8(6), 2000, 1003-1009.
//
// For n = 1, 2, .. a line is laid through the newest sample y_k, with the slope
//     end-fit   b_n = (y_k - y_{k-n}) / n
//     best-fit  b_n = sum_{l=0..n} (n - 2l) y_{k-l} / (n (n+1) (n+2) / 6), the least-squares slope of the n +
//     1 samples.
// n is widened while |y_k - j b_n - y_{k-j}| <= d for every j = 1 .. n, where the band d is one resampled
// step. The last slope that held is the estimate: long windows at low speed, where a quantum is large beside
// the motion; short ones as soon as the motion bends. Public implementations differ in whether j = n is
// checked in the best fit; here it is.
//
// Cost is linear in the window, where the definition read literally is quadratic. Sample j admits the slopes
// [(y_k - y_{k-j} - d) / j, (y_k - y_{k-j} + d) / j]; the intersection of these intervals, the cone, is kept
// while the window is widened, and a line holds exactly when its slope lies in the cone. The least-squares
// numerator is kept as a running sum: N_n = N_{n-1} + n D_n - (D_1 + .. + D_{n-1}) with D_j = y_k - y_{k-j}.
//
// Decisions are exact, so float, double, x86 and ARM choose the same window. Positions are counted in steps;
// slopes are counted in 1/K step per sample with K = 12252240, the least common multiple of all n and all n
// (n+1) (n+2) / 6 up to 16, which makes every slope and bound above an integer; and they are taken relative
// to the slope of the newest interval, which leaves every n unchanged. With d = 1 no window that holds
// contains a second difference beyond 4 steps, so a sample with a larger one restarts the window at a single
// interval (the same choice as the definition's), and what remains is below 60 K < 2^31.
//
// Valid: window 1 .. 16 intervals (others are taken as the nearer limit), step >= 1 count, count_length in
// metres per count > 0, period in seconds > 0. Counts should be multiples of the step; what is left over is
// carried, not lost. Every count is valid: a jump saturates to int32 counts, so the output (m/s) is finite.
// The window may change between samples; after another step or period call reset().
//
// Cost of update() for window 16 on a Cortex-M4 (GCC 12.2, -O2; executed instructions, every window holding):
// 540 for the best fit (31 for each sample of the window), 415 for the end fit (22); a shorter window saves
// in proportion. The count extension and the resampling before it take 52 more.
template <typename Scalar>
class FoawVelocity {
 public:
  struct Coefficients {
    std::int32_t step = 1;
    std::int32_t window = 1;
    Scalar scale = 0;       // m/s for one step per sample
    Scalar fine_scale = 0;  // m/s for 1/K step per sample
    Scalar per_sample = 0;  // steps per sample for 1 m/s
  };

  static constexpr Coefficients prepare(std::int32_t window, Scalar period, Scalar count_length,
                                        std::int32_t step) {
    Coefficients coefficients;
    coefficients.step = step < 1 ? 1 : step;
    coefficients.window = window < 1 ? 1 : window > foaw_window_max ? foaw_window_max : window;
    coefficients.scale = count_length * static_cast<Scalar>(coefficients.step) / period;
    coefficients.fine_scale = coefficients.scale / static_cast<Scalar>(slope_unit);
    coefficients.per_sample = Scalar{1} / coefficients.scale;
    return coefficients;
  }

  FoawVelocity() { reset(0); }

  // As if the handle had always stood on this count.
  void reset(std::int64_t count) {
    last_ = count;
    history_.fill(0);
    head_ = 0;
    moved_ = 0;
    known_ = foaw_window_max;
    window_ = 1;
  }

  // As if the handle had come to this count at a constant velocity, m/s. A velocity beyond 2^18 steps per
  // sample is cut to that: the next sample then restarts the window.
  void reset(const Coefficients& coefficients, std::int64_t count, Scalar velocity) {
    constexpr auto fastest = static_cast<Scalar>(1 << 18);
    Scalar speed = velocity * coefficients.per_sample;
    if (speed > fastest) speed = fastest;
    if (!(speed > -fastest)) speed = -fastest;
    const Scalar half = speed < 0 ? Scalar{-0.5} : Scalar{0.5};
    last_ = count;
    head_ = 0;
    for (std::int32_t i = 0; i < samples; ++i) {
      const auto back = static_cast<std::int32_t>(speed * static_cast<Scalar>(i) + half);
      const std::uint32_t position = 0U - static_cast<std::uint32_t>(back);
      history_[static_cast<std::size_t>(i)] = position;
      history_[static_cast<std::size_t>(i + samples)] = position;
    }
    moved_ = static_cast<std::int32_t>(history_[0] - history_[1]);
    known_ = foaw_window_max;
    window_ = 1;
  }

  // Takes a sample in; about 50 Cortex-M4 instructions.
  void push(const Coefficients& coefficients, std::int64_t count) {
    const std::int32_t difference = saturated_difference(count, last_);
    const std::int32_t moved = difference / coefficients.step;
    last_ = count - difference % coefficients.step;
    const std::uint32_t position = history_[head_] + static_cast<std::uint32_t>(moved);
    head_ = head_ == 0 ? samples - 1 : head_ - 1;
    history_[head_] = position;
    history_[head_ + samples] = position;
    const std::int32_t bend = saturated_difference(moved, moved_);
    moved_ = moved;
    if (bend > 4 || bend < -4) {
      known_ = 1;
    } else if (known_ < foaw_window_max) {
      ++known_;
    }
  }

  // Velocity at the newest sample, m/s.
  template <FoawFit fit>
  Scalar estimate(const Coefficients& coefficients) {
    const std::uint32_t* sample = &history_[head_];
    const auto first = static_cast<std::uint32_t>(moved_);
    const Reciprocals* reciprocals = &reciprocal_table[2];
    const std::int32_t longest = known_ < coefficients.window ? known_ : coefficients.window;
    // Slopes in 1/K step per sample, less that of the newest interval: sample 1 then lies on the line of
    // slope 0.
    std::int32_t lowest = -slope_unit;
    std::int32_t highest = slope_unit;
    std::int32_t slope = 0;
    std::int32_t sum = 0;      // D_1 + .. + D_n
    std::int32_t fit_sum = 0;  // N_n
    std::uint32_t line = *sample++ - first;
    std::int32_t n = 2;
    for (; n <= longest; ++n, ++reciprocals) {
      line -= first;
      const auto distance =
          static_cast<std::int32_t>(line - *++sample);  // D_n less that of the newest interval
      // K / n is both the weight of the sample and, as d = 1, the half width of the slopes it admits.
      const std::int32_t end_slope = distance * reciprocals->end;
      lowest = std::max(lowest, end_slope - reciprocals->end);
      highest = std::min(highest, end_slope + reciprocals->end);
      std::int32_t candidate = end_slope;
      if constexpr (fit == FoawFit::best) {
        fit_sum += n * distance - sum;
        sum += distance;
        candidate = fit_sum * reciprocals->best;
      }
      if (candidate < lowest || candidate > highest) break;
      slope = candidate;
    }
    window_ = n - 1;
    return static_cast<Scalar>(moved_) * coefficients.scale +
           static_cast<Scalar>(slope) * coefficients.fine_scale;
  }

  Scalar update(const Coefficients& coefficients, std::int64_t count, FoawFit fit) {
    push(coefficients, count);
    return fit == FoawFit::best ? estimate<FoawFit::best>(coefficients)
                                : estimate<FoawFit::end>(coefficients);
  }

  // Number of intervals behind the last estimate, 1 .. 16.
  std::int32_t window() const { return window_; }

 private:
  static constexpr std::int32_t samples = foaw_window_max + 1;
  static constexpr std::int32_t slope_unit = 12252240;  // K
  struct Reciprocals {
    std::int32_t end = 0;   // K / n
    std::int32_t best = 0;  // K / (n (n+1) (n+2) / 6)
  };
  static constexpr std::array<Reciprocals, foaw_window_max + 1> make_reciprocals() {
    std::array<Reciprocals, foaw_window_max + 1> table{};
    for (std::int32_t n = 1; n <= foaw_window_max; ++n) {
      table[static_cast<std::size_t>(n)] = {slope_unit / n, slope_unit / (n * (n + 1) * (n + 2) / 6)};
    }
    return table;
  }
  static constexpr bool every_slope_is_whole() {
    for (std::int32_t n = 1; n <= foaw_window_max; ++n) {
      if (slope_unit % n != 0 || slope_unit % (n * (n + 1) * (n + 2) / 6) != 0) return false;
    }
    return true;
  }
  static_assert(every_slope_is_whole());
  static constexpr std::array<Reciprocals, foaw_window_max + 1> reciprocal_table = make_reciprocals();

  // Every sample is written twice, so that the newest `samples` of them are contiguous from head_ on, newest
  // first.
  std::array<std::uint32_t, 2 * samples> history_{};
  std::int64_t last_ = 0;  // count up to which movement has been taken in
  std::size_t head_ = 0;
  std::int32_t moved_ = 0;  // steps in the newest interval
  std::int32_t known_ = foaw_window_max;
  std::int32_t window_ = 1;
};

}  // namespace kmax::control
