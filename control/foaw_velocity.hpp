#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "control/chord_window.hpp"
#include "control/saturated_difference.hpp"
#include "control/word_transfer.hpp"

namespace kmax::control {

enum class FoawFit : std::uint8_t { best, end };

inline constexpr std::int32_t foaw_window_max = chord_window_max;

// First-order adaptive windowing: F. Janabi-Sharifi, V. Hayward, C.-S. J. Chen, "Discrete-time adaptive
// windowing for velocity estimation", IEEE Trans. Control Systems Technology 8(6), 2000, 1003-1009.
//
// Window. For n = 1, 2, .. the chord from the newest sample y_k to y_{k-n} is laid, with the slope
//     b_n = (y_k - y_{k-n}) / n,
// and n is widened while |y_k - j b_n - y_{k-j}| <= d for every j = 1 .. n, where the band d is one resampled
// step. The last n that held is the window: long at low speed, where a quantum is large beside the motion;
// short as soon as the motion bends.
//
// Slope, over that window:
//     end fit    the chord's, b_n
//     best fit   the least-squares one, sum_{l=0..n} (n - 2l) y_{k-l} / (n (n+1) (n+2) / 6)
//
// The paper's best fit checks the least-squares line itself against the band while it widens the window; here
// both fits take the chord's window. The end fit is the paper's unchanged. For the best fit the choice of the
// window becomes a search in whole numbers without the sums, and those are needed once instead of for every
// n: half of the instructions. What it does to the error is in docs/velocity_estimators.md: over twelve
// cases it lies between -8 % and +3 % of what the paper's check gives, equal in seven.
//
// Decisions are exact, so float, double, x86 and ARM choose the same window (chord_window.hpp). The sums are
// differences of running sums in 32-bit words, exact modulo 2^32, and the slope is taken relative to that of
// the newest interval, so that what is converted to floating point is small. With d = 1 no window that holds
// contains a second difference beyond 4 steps: larger ones are cut to [-8, 7] in the stored positions, which
// the search relies on; the window ends there either way.
//
// Valid: window 1 .. 16 intervals (others are taken as the nearer limit), step >= 1 count, count_length in
// metres per count > 0, period in seconds > 0. Counts should be multiples of the step; what is left over is
// carried, not lost. Every count below 2^62 is valid: a jump saturates to int32 counts, so the output (m/s)
// is finite. The window may change between samples; after another step or period call reset().
//
// Cost on a Cortex-M4F (GCC 12.2, -O2; executed instructions): the same for every input that holds over 16
// intervals, less when the window ends earlier; with the count extension, the resampling and the choice of
// the estimator 231 for the best fit, 239 for the end fit. 109 of these are the search for the window. 552
// bytes.
template <typename Scalar>
class FoawVelocity {
 public:
  struct Coefficients {
    std::int32_t step = 1;
    std::int32_t window = 1;
    Scalar scale = 0;       // m/s for one step per sample
    Scalar per_sample = 0;  // steps per sample for 1 m/s
  };

  static constexpr Coefficients prepare(std::int32_t window, Scalar period, Scalar count_length,
                                        std::int32_t step) {
    Coefficients coefficients;
    coefficients.step = std::max(step, std::int32_t{1});
    coefficients.window = std::clamp(window, std::int32_t{1}, foaw_window_max);
    coefficients.scale = count_length * static_cast<Scalar>(coefficients.step) / period;
    coefficients.per_sample = Scalar{1} / coefficients.scale;
    return coefficients;
  }

  // As if the handle had always stood on this count.
  void reset(std::int64_t count) {
    last_ = count;
    newest_ = {};
    for (std::uint32_t& word : rings_) word = 0;
    window_ = 1;
  }

  // As if the handle had come to this count at a constant velocity, m/s, and its last sample lay `ago` of an
  // interval back, 0 <= ago < 1. Returns the steps moved since that sample. A velocity beyond 2^18 steps per
  // sample is cut to that: the next sample then restarts the window.
  std::int32_t reset(const Coefficients& coefficients, std::int64_t count, Scalar velocity, Scalar ago) {
    constexpr auto fastest = static_cast<Scalar>(1 << 18);
    Scalar speed = velocity * coefficients.per_sample;
    if (speed > fastest) speed = fastest;
    if (!(speed > -fastest)) speed = -fastest;
    const Scalar half = speed < 0 ? Scalar{-0.5} : Scalar{0.5};
    last_ = count;
    std::uint32_t sum_so_far = 0;
    std::uint32_t double_sum_so_far = 0;
    for (std::uint32_t i = 0; i < foaw_window_max + 2; ++i) {
      const auto back = static_cast<std::int32_t>(speed * (static_cast<Scalar>(i) + ago) + half);
      const std::uint32_t at = 0U - static_cast<std::uint32_t>(back);
      rings_[i] = rings_[i + ring] = at;
      rings_[2 * i + sums] = sum_so_far;
      rings_[2 * i + sums + 1] = double_sum_so_far;
      double_sum_so_far -= sum_so_far;
      sum_so_far -= at;
      double_sum_so_far -= sum_so_far;
    }
    newest_ = {};
    newest_.position = rings_[0];
    newest_.interval = rings_[0] - rings_[1];
    newest_.steps = static_cast<std::int32_t>(newest_.interval);
    window_ = 1;
    return static_cast<std::int32_t>(0U - newest_.position);
  }

  // What push() leaves for estimate().
  struct Pushed {
    const std::uint32_t* positions = nullptr;  // the newest one; older ones behind it
    std::uint32_t interval{};                  // the newest one less the second newest
  };

  // Takes a sample in that lies `steps` from the one before.
  Pushed push(std::int32_t steps) {
    const std::uint32_t interval =
        newest_.interval + static_cast<std::uint32_t>(difference_to_4_bits(steps, newest_.steps));
    const std::uint32_t position = newest_.position + interval;
    const std::uint32_t sum = newest_.sum + position;
    const std::uint32_t double_sum = newest_.double_sum + newest_.sum + sum;
    const std::uint32_t head = (newest_.head - 1) & (ring - 1);
    newest_.head = head;
    newest_.interval = interval;
    newest_.steps = steps;
    newest_.position = position;
    newest_.sum = sum;
    newest_.double_sum = double_sum;
    std::uint32_t* const positions = &rings_[head];
    positions[0] = position;
    positions[ring] = position;
    store_two<sums>(&rings_[2 * head], {sum, double_sum});
    return {positions, interval};
  }

  // Velocity at the newest sample, m/s. Directly after push().
  template <FoawFit fit>
  Scalar estimate(const Coefficients& coefficients, const Pushed& pushed) {
    std::int32_t n = ChordWindow::find(pushed.positions, pushed.interval);
    if (n > coefficients.window) n = coefficients.window;
    window_ = n;
    const auto intervals = static_cast<std::uint32_t>(n);
    std::uint32_t numerator = 0;
    if constexpr (fit == FoawFit::best) {
      const std::uint32_t samples = intervals + 1;
      const TwoWords before = load_two<sums>(&rings_[2 * ((newest_.head + samples) & (ring - 1))]);
      numerator = samples * (newest_.sum + before.first) - (newest_.double_sum - before.second);
    } else {
      numerator = newest_.position - rings_[newest_.head + intervals];
    }
    // Relative to the newest interval, so that what is converted is small.
    constexpr const Divisors& divisors = fit == FoawFit::best ? best_fit : end_fit;
    numerator -= newest_.interval * divisors[intervals].whole;
    const Scalar slope =
        static_cast<Scalar>(static_cast<std::int32_t>(numerator)) * divisors[intervals].inverse;
    return (static_cast<Scalar>(newest_.steps) + slope) * coefficients.scale;
  }

  Scalar update(const Coefficients& coefficients, std::int64_t count, FoawFit fit) {
    const Pushed pushed = push(steps_to(coefficients, count));
    return fit == FoawFit::best ? estimate<FoawFit::best>(coefficients, pushed)
                                : estimate<FoawFit::end>(coefficients, pushed);
  }

  // Number of intervals behind the last estimate, 1 .. 16.
  std::int32_t window() const { return window_; }

 private:
  static constexpr std::uint32_t ring = 32;  // a power of two above the 18 samples that are needed

  // Steps from the last count to this one; what is left over stays for the next.
  std::int32_t steps_to(const Coefficients& coefficients, std::int64_t count) {
    const std::int32_t difference = count_difference(count, last_);
    const std::int32_t moved = difference / coefficients.step;
    last_ = count - (difference - moved * coefficients.step);
    return moved;
  }

  // What the numerators are divided by, for every n: n, or n (n+1) (n+2) / 6 for the best fit.
  struct Divisor {
    std::uint32_t whole = 1;
    Scalar inverse = 1;
  };
  using Divisors = std::array<Divisor, foaw_window_max + 1>;
  static constexpr Divisors make_divisors(FoawFit fit) {
    Divisors table{};
    for (std::uint32_t n = 1; n <= foaw_window_max; ++n) {
      const std::uint32_t whole = fit == FoawFit::best ? n * (n + 1) * (n + 2) / 6 : n;
      table[n] = {whole, Scalar{1} / static_cast<Scalar>(whole)};
    }
    return table;
  }
  static constexpr Divisors best_fit = make_divisors(FoawFit::best);
  static constexpr Divisors end_fit = make_divisors(FoawFit::end);

  // What is known of the newest sample.
  struct Newest {
    std::uint32_t head = 0;      // where it lies in the rings; older ones lie behind it
    std::uint32_t interval = 0;  // its position less that of the second newest
    std::int32_t steps = 0;  // steps moved in it: `interval` and what bends beyond a window have left behind
    std::uint32_t position = 0;    // in steps, modulo 2^32
    std::uint32_t sum = 0;         // S_k: of all positions so far, modulo 2^32
    std::uint32_t double_sum = 0;  // D_k: of all S_i + S_{i-1} so far, modulo 2^32
  };

  // Two rings. The positions, each written twice, so that the newest ones are contiguous; behind them, from
  // `sums` on, the sum and the double sum of every sample. Of these a window of n intervals needs those
  // before it:
  //     sum_{l=0..n} (n - 2l) y_{k-l} = (n + 1) (S_k + S_{k-n-1}) - (D_k - D_{k-n-1}),
  // D the double sum. Plain arrays: the compiler then knows that a write to one leaves the others alone.
  static constexpr std::uint32_t sums = 2 * ring;
  std::uint32_t rings_[4 * ring] = {};
  Newest newest_;
  std::int64_t last_ = 0;  // count up to which update() has taken movement in
  std::int32_t window_ = 1;
};

}  // namespace kmax::control
