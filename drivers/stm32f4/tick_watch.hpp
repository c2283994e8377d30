#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/dma.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

// Takes the force away when the ticks stay away, without the core: it may hang in the tick itself, be locked
// up, or be halted by a debugger, for whom timers and DMA go on. RM0090, Advanced-control timers, DMA
// controller. No pin of the board is left for a break input.
//
// - Each turn of TIM8: stream 1 of DMA2 puts the comparison of its channel 4 into the middle of the half
//   period to come.
// - Each tick: one store puts it out of reach again.
// - No tick by then: stream 7 gives TIM1 a break and an event on channel 4, and on that event stream 4 writes
//   TIM8's BDTR without MOE.
//
// So the gates are off at most 25 us + 12.5 us after the last tick began, and stay off: MOE is cleared as by
// a break, and nothing but `arm` sets it. Both timers' CC4IF say who did it
// (ThreePhasePwm::ISR_ticks_stayed_away). With the bridges off it does nothing, so that an erase, in which no
// tick comes, needs no exception.
//
// TIM8 watches because TIM1 starts the conversions: if TIM1 stands still, so do the ticks. The timers must
// NOT be frozen by DBGMCU. RM0090 does not say what a frozen timer's outputs do, and MOE would survive the
// halt: the force would come back by itself.
//
// Contexts: `start` once, the counters running. The object must lie in SRAM: DMA reads its words.

namespace kmax::drivers::stm32f4 {

template <typename Timer = TimerRegisters, typename Dma = DmaRegisters>
class TickWatch {
 public:
  /// Above any count.
  static constexpr std::uint32_t out_of_reach = 0xFFFF;

  TickWatch(Timer& leader, Timer& follower, Dma& dma) : leader_(leader), follower_(follower), dma_(dma) {}
  TickWatch(const TickWatch&) = delete;
  TickWatch& operator=(const TickWatch&) = delete;

  /// Ticks must come already.
  void start(std::uint32_t half_period_ticks) {
    middle_ = half_period_ticks / 2;
    disarmed_ = static_cast<std::uint32_t>(follower_.bdtr) & ~timer_bdtr::MainOutputEnable::mask;
    carry(dma2_tim8_compare_4, event_, leader_.egr);
    carry(dma2_tim1_compare_4, disarmed_, follower_.bdtr);
    carry(dma2_tim8_update, middle_, follower_.ccr[3]);
    leader_.dier = timer_dier::CaptureCompareDma<4>::mask;
    follower_.dier = timer_dier::CaptureCompareDma<4>::mask | timer_dier::UpdateDma::mask;
  }

  void ISR_tick() { follower_.ccr[3] = out_of_reach; }

 private:
  template <typename Target>
  static std::uint32_t address_of(const Target& target) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&target));
  }
  template <typename Target>
  void carry(DmaRequest request, const std::uint32_t& word, const Target& target) {
    auto& stream = dma_.stream[request.stream];
    stream.par = address_of(target);
    stream.m0ar = address_of(word);
    stream.ndtr = 1;
    stream.cr = dma_cr::Enable::mask | dma_cr::Circular::mask | dma_cr::Channel::bits(request.channel) |
                dma_cr::Direction::bits(dma_cr::memory_to_peripheral) |
                dma_cr::PeripheralSize::bits(dma_cr::words) | dma_cr::MemorySize::bits(dma_cr::words) |
                dma_cr::Priority::bits(dma_cr::very_high);
  }

  Timer& leader_;
  Timer& follower_;
  Dma& dma_;
  // What DMA carries.
  std::uint32_t middle_{}, disarmed_{};
  std::uint32_t event_ = timer_egr::Break::mask | timer_egr::CaptureCompare<4>::mask;
};

}  // namespace kmax::drivers::stm32f4
