#pragma once

#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

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
