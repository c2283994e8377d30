#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/can.hpp"

// Bit timing of bxCAN: how a bit is made of time quanta. RM0090 chapter on bxCAN, section Bit timing; ISO
// 11898-1; CiA 301, section Bit rates and timing (sample point 87.5 %, from 85 to 90 %, at 1 Mbit/s from 75
// to 90 %).
//
//   bit = 1 + segment_1 + segment_2 quanta, sampled after 1 + segment_1; a quantum is `prescaler` periods of
//   APB1
//
// From 42 MHz all four rates come out exactly (checked below), each sampled at 85.7 % or 87.5 %.
//
// A rate that is known when the program is written: `can_bit_timing<42'000'000, 500'000>()`, which does not
// compile when the tolerances are not kept. One that is a parameter: `solve_can_bit_timing`, and ask
// `usable`.

namespace kmax::drivers::stm32f4 {

struct CanBitTiming {
  std::uint16_t prescaler = 0;  ///< 1 to 1024; 0: no timing
  std::uint8_t segment_1 = 0;   ///< 1 to 16 quanta: propagation and phase segment 1
  std::uint8_t segment_2 = 0;   ///< 1 to 8 quanta
  std::uint8_t jump_width = 0;  ///< 1 to 4 quanta, not above segment_2

  constexpr std::uint32_t quanta() const { return 1U + segment_1 + segment_2; }
  constexpr std::uint32_t sample_point_permille() const {
    return (1000U * (1U + segment_1) + quanta() / 2) / quanta();
  }

  constexpr bool valid() const {
    return prescaler >= 1 && prescaler <= 1024 && segment_1 >= 1 && segment_1 <= 16 && segment_2 >= 1 &&
           segment_2 <= 8 && jump_width >= 1 && jump_width <= 4 && jump_width <= segment_2;
  }

  /// The value of BTR in normal mode.
  constexpr std::uint32_t btr() const {
    return can_btr::Prescaler::bits(prescaler - 1U) | can_btr::Segment1::bits(segment_1 - 1U) |
           can_btr::Segment2::bits(segment_2 - 1U) | can_btr::JumpWidth::bits(jump_width - 1U);
  }

  friend constexpr bool operator==(const CanBitTiming&, const CanBitTiming&) = default;
};

struct CanBitTimingGoal {
  std::uint32_t sample_point_permille = 875;
  std::uint32_t sample_point_tolerance_permille = 25;
  std::uint32_t rate_tolerance_ppm = 1000;
};

struct CanBitTimingSolution {
  CanBitTiming timing{};
  std::uint32_t rate_error_ppm = 0;  ///< of the clock that is asked for, without the crystal's own
  std::uint32_t sample_error_permille = 0;
  bool usable = false;  ///< both within tolerance
};

namespace detail {
constexpr std::uint32_t distance(std::uint32_t a, std::uint32_t b) {
  return a < b ? b - a : a - b;
}
}  // namespace detail

/// The best there is for clocks up to 168 MHz and rates from 10 kbit/s to 1 Mbit/s: first by rate, then by
/// sample point, then by the number of quanta. Not usable outside of that. At configuration time (some
/// hundred divisions).
constexpr CanBitTimingSolution solve_can_bit_timing(std::uint32_t clock_hz, std::uint32_t bit_rate,
                                                    const CanBitTimingGoal& goal = {}) {
  CanBitTimingSolution best{};
  if (clock_hz == 0 || clock_hz > 168'000'000 || bit_rate < 10'000 || bit_rate > 1'000'000) return best;
  bool found = false;
  for (std::uint32_t quanta = 25; quanta >= 4; --quanta) {
    const std::uint32_t clocks = quanta * bit_rate;
    const std::uint32_t prescaler = (clock_hz + clocks / 2) / clocks;
    if (prescaler < 1 || prescaler > 1024) continue;
    const std::uint32_t made = clock_hz / (prescaler * quanta);
    const std::uint32_t off = detail::distance(made, bit_rate);
    if (off > bit_rate / 4) continue;
    // In parts per million, within 32 bits, and rather too much than too little.
    std::uint32_t rate_error = off * 10'000U / (bit_rate / 100U);
    if (rate_error == 0 && clock_hz % (prescaler * quanta) != 0) rate_error = 1;
    for (std::uint32_t segment_2 = 1; segment_2 <= 8 && segment_2 + 2 <= quanta; ++segment_2) {
      const std::uint32_t segment_1 = quanta - 1 - segment_2;
      if (segment_1 > 16) continue;
      CanBitTiming timing{static_cast<std::uint16_t>(prescaler), static_cast<std::uint8_t>(segment_1),
                          static_cast<std::uint8_t>(segment_2),
                          static_cast<std::uint8_t>(segment_2 < 4 ? segment_2 : 4)};
      const std::uint32_t sample_error =
          detail::distance(timing.sample_point_permille(), goal.sample_point_permille);
      const bool better = !found || rate_error < best.rate_error_ppm ||
                          (rate_error == best.rate_error_ppm && sample_error < best.sample_error_permille);
      if (!better) continue;
      found = true;
      best.timing = timing;
      best.rate_error_ppm = rate_error;
      best.sample_error_permille = sample_error;
    }
  }
  best.usable = found && best.rate_error_ppm <= goal.rate_tolerance_ppm &&
                best.sample_error_permille <= goal.sample_point_tolerance_permille;
  return best;
}

template <std::uint32_t clock_hz, std::uint32_t bit_rate>
consteval CanBitTiming can_bit_timing() {
  constexpr CanBitTimingSolution solution = solve_can_bit_timing(clock_hz, bit_rate);
  static_assert(solution.usable,
                "this bit rate or sample point cannot be had from this clock within tolerance");
  return solution.timing;
}

// The settings of the board's 42 MHz.
static_assert(can_bit_timing<42'000'000, 1'000'000>().btr() == 0x011A'0002);
static_assert(can_bit_timing<42'000'000, 500'000>().sample_point_permille() == 857);
static_assert(can_bit_timing<42'000'000, 250'000>().sample_point_permille() == 875);
static_assert(can_bit_timing<42'000'000, 125'000>().sample_point_permille() == 875);

}  // namespace kmax::drivers::stm32f4
