#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "control/word_transfer.hpp"

#if defined(__ARM_FEATURE_SIMD32)
#include <arm_acle.h>
#endif

namespace kmax::control {

/// The longest window considered, in intervals.
inline constexpr std::int32_t chord_window_max = 16;

/// Both 16-bit halves of a - b on their own, each bounded below by 0 (all halves unsigned): UQSUB16.
inline std::uint32_t halves_beyond(std::uint32_t a, std::uint32_t b) {
#if defined(__ARM_FEATURE_SIMD32)
  return __uqsub16(a, b);
#else
  // Without branches: these go either way for every sample.
  const auto low = static_cast<std::int32_t>(a & 0xFFFFU) - static_cast<std::int32_t>(b & 0xFFFFU);
  const auto high = static_cast<std::int32_t>(a >> 16) - static_cast<std::int32_t>(b >> 16);
  return static_cast<std::uint32_t>(high & ~(high >> 31)) << 16 |
         static_cast<std::uint32_t>(low & ~(low >> 31));
#endif
}

/// What a sample weighs in the search, by how many intervals j it lies back.
struct ChordWeights {
  static constexpr std::uint32_t unit = 5040;  ///< slopes are counted in 1/5040 step per sample
  static constexpr std::uint32_t slack = 10;   ///< what the cone is wider by

  static constexpr std::uint32_t reciprocal(std::uint32_t j) { return (unit + j / 2) / j; }

  constexpr ChordWeights() {
    of[0] = 65535U * unit;
    of[1] = 65537U * (unit + slack);
    for (std::uint32_t j = 1; j <= chord_window_max; ++j) {
      of[2 * j] = 0U - 65535U * reciprocal(j);
      of[2 * j + 1] = 65537U * (reciprocal(j) + slack);
    }
  }
  /// At 0 and 1: what opens the cone by the newest interval. At 2j: R - 2^16 R with R = 5040 / j rounded. At
  /// 2j + 1: R + slack in both halves.
  std::array<std::uint32_t, 2 * chord_window_max + 4> of{};
};
inline constexpr ChordWeights chord_weights{};

/// How far back a straight line through the newest of a series of integer positions stays within 1 of all of
/// them: the largest n <= 16 such that for every m = 1 .. n the chord from the newest sample to the one m
/// intervals before it passes within 1 of the samples in between. At least 1.
///
/// `newest` points at the newest position y_0; y_j, j intervals older, is newest[j]; 17 are read at most.
/// Positions count modulo 2^32. `interval` is y_0 - y_1.
///
/// Precondition: no second difference y_{j-1} - 2 y_j + y_{j+1} is outside [-8, 7] (within the window, only
/// those within +-4 can occur at all; the caller bounds the rest).
///
/// Method. Sample j admits the slopes [(D_j - 1) / j, (D_j + 1) / j] with D_j = y_0 - y_j. The intersection
/// of these intervals, the cone, is narrowed sample by sample, and the chord to sample n holds if its slope
/// D_n / n lies in the cone of those before it. Slopes are counted in 1/5040 step per sample: that makes D_j
/// / j whole except for j = 11 and 13, whose reciprocals are rounded. For the comparison that leaves an error
/// of at most 7, while two different slopes with denominators up to 16 are at least 19 apart (21 = 5040 / 240
/// without the rounding): with 10 added to the cone on both sides every decision is the exact one, ties
/// included.
///
/// The two distances from the borders, t_low = slope - low and t_high = high - slope, share a word,
/// t_low + 2^16 t_high, and one multiply-accumulate makes both: D (R - 2^16 R) + (2^16 high - low). This is
/// linear and modulo 2^32, so the large common part of D and the borders, j times the newest interval,
/// cancels by itself (for 11 and 13, where j R_j is 5038 and 5044, explicitly). What is left is below 2^15 in
/// magnitude thanks to the precondition: a negative half shows as its top bit, and a border moves by what t
/// has beyond the width of the sample's own interval.
///
/// Cost: 7 instructions per sample on a Cortex-M4, straight through; about 110 for 16.
class ChordWindow {
 public:
  [[gnu::noinline]] static std::int32_t find(const std::uint32_t* newest, std::uint32_t interval) {
    const std::uint32_t* weights = chord_weights.of.data();
    // Otherwise the compiler writes the weights into the code, two instructions for each instead of a
    // quarter.
    asm("" : "+r"(weights));
    const FourWords start = load_next_four(weights);
    std::uint32_t imbalance = interval * 65535U;
    asm("" : "+r"(imbalance));
    Search search{newest, weights, *newest, interval * start.first + start.second, imbalance};
    return from<2>(search);
  }

 private:
  using Weights = ChordWeights;
  static constexpr std::uint32_t top_bits = 0x80008000U;

  struct Search {
    const std::uint32_t* samples;
    const std::uint32_t* weights;
    std::uint32_t newest;
    std::uint32_t cone;       // 2^16 high - low
    std::uint32_t imbalance;  // of the newest interval, for samples where j R_j is not 5040
  };

  template <std::size_t j>
  [[gnu::always_inline]] static std::uint32_t distances(const Search& s, std::uint32_t position,
                                                        std::uint32_t weight) {
    constexpr std::uint32_t error = static_cast<std::uint32_t>(j) * Weights::reciprocal(j) - Weights::unit;
    std::uint32_t cone = s.cone;
    if constexpr (error == 4) cone += s.imbalance << 2;
    if constexpr (error == 0U - 2U) cone -= s.imbalance << 1;
    static_assert(error == 0 || error == 4 || error == 0U - 2U);
    return (s.newest - position) * weight + cone;
  }

  // Takes in samples j and j + 1, with one test for both, and goes on from there.
  template <std::size_t j>
  [[gnu::always_inline]] static std::int32_t from(Search s) {
    const FourWords weight = load_next_four(s.weights);
    if constexpr (j == chord_window_max) {
      const std::uint32_t last = distances<j>(s, s.samples[j], weight.first);
      return (last & top_bits) != 0 ? chord_window_max - 1 : chord_window_max;
    } else {
      const TwoWords positions = load_two<j>(s.samples);
      const std::uint32_t first = distances<j>(s, positions.first, weight.first);
      s.cone -= halves_beyond(first, weight.second);
      const std::uint32_t second = distances<j + 1>(s, positions.second, weight.third);
      if (((first | second) & top_bits) != 0) [[unlikely]] {
        return static_cast<std::int32_t>((first & top_bits) != 0 ? j - 1 : j);
      }
      s.cone -= halves_beyond(second, weight.fourth);
      return from<j + 2>(s);
    }
  }
};

}  // namespace kmax::control
