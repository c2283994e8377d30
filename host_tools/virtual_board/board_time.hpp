#pragma once

#include <cstdint>
#include <limits>

namespace kmax::virtual_board {

/// Time on the virtual board, counted since power-up in periods of 336 MHz, the frequency of the PLL's
/// oscillator from which the running part derives all its clocks: 168, 84, 42, 21 MHz and the internal 16 MHz
/// are whole numbers of it, so no clock edge is ever rounded. Wraps after 1,700 years.
using BoardTime = std::uint64_t;

inline constexpr BoardTime units_per_second = 336'000'000;
inline constexpr BoardTime units_per_microsecond = units_per_second / 1'000'000;
inline constexpr BoardTime never = std::numeric_limits<BoardTime>::max();

/// 0 when the frequency does not divide 336 MHz.
constexpr BoardTime units_per_period(std::uint64_t hz) {
  return hz != 0 && units_per_second % hz == 0 ? units_per_second / hz : 0;
}

constexpr double seconds(BoardTime duration) {
  return static_cast<double>(duration) / static_cast<double>(units_per_second);
}

/// Periods of the clocks that the part runs on at present, in units of BoardTime. Written by the RCC model
/// alone, read by all others; what comes out of reset is the internal 16 MHz everywhere.
struct BoardClocks {
  static constexpr BoardTime internal = units_per_period(16'000'000);
  BoardTime core = internal;        ///< HCLK, also the processor's cycle
  BoardTime apb1 = internal;        ///< USART2, UART4, SPI3, CAN1
  BoardTime apb2 = internal;        ///< ADC before its own prescaler
  BoardTime apb1_timer = internal;  ///< TIM2 to TIM5
  BoardTime apb2_timer = internal;  ///< TIM1, TIM8
};

}  // namespace kmax::virtual_board
