#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/registers/timer.hpp"

// What all timers' capture/compare channels share: RM0090, registers TIMx_CCMR1, TIMx_CCMR2 and TIMx_CCER.
// Channels by index from 0; the fields are those of channel 1.

namespace kmax::virtual_board {

/// A register that takes effect with an update event.
struct PreloadedWord {
  std::uint32_t preload = 0;  ///< as written
  std::uint32_t active = 0;
};

/// A channel's part of CCMR1 and CCMR2.
constexpr std::uint32_t channel_mode(const std::array<std::uint32_t, 2>& ccmr, unsigned index) {
  return ccmr[index / 2] >> (drivers::stm32f4::timer_ccmr::bits_per_channel * (index % 2));
}

/// A channel's part of CCER, with those of the channels above it.
constexpr std::uint32_t channel_switches(std::uint32_t ccer, unsigned index) {
  return ccer >> (drivers::stm32f4::timer_ccer::bits_per_channel * index);
}

}  // namespace kmax::virtual_board
