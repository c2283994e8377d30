#pragma once

#include <cstdint>

#include "host_tools/virtual_board/board_time.hpp"

// The arithmetic of the clock tree and its limits: RM0090, chapter Reset and clock control for STM32F405xx
// (RCC), section Clocks; STM32F405 data sheet, general operating conditions and main PLL characteristics. All
// throw RefusedAccess with the value and what is allowed.

namespace kmax::virtual_board {

inline constexpr std::uint64_t internal_oscillator_hz = 16'000'000;
inline constexpr std::uint64_t crystal_hz = 8'000'000;

/// M, N and Q of a PLLCFGR: input, VCO and the 48 MHz output within their limits.
void check_pll(std::uint32_t pllcfgr);

/// System clock that a PLLCFGR makes.
std::uint64_t pll_output_hz(std::uint32_t pllcfgr);

/// What the highest HCLK depends on.
struct ClockConditions {
  std::uint32_t flash_wait_states;
  bool voltage_scale_1;
};

/// The periods behind the prescalers of a CFGR, all of them within their limits.
BoardClocks board_clocks(std::uint64_t system_clock_hz, std::uint32_t cfgr,
                         const ClockConditions& conditions);

}  // namespace kmax::virtual_board
