#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/timer.hpp"

// A pulse on channel 4 of TIM2 to TIM5 that ends by itself, whatever the core does. RM0090, General-purpose
// timers, One-pulse mode. In PWM mode 2 the channel is high from CCR4 = 1 on; at ARR the counter goes back to
// 0 and stops.

namespace kmax::drivers::stm32f4 {

template <typename Registers = TimerRegisters>
class OnePulseOutput {
 public:
  explicit constexpr OnePulseOutput(Registers& registers) : registers_(registers) {}

  /// `ticks`: length of the pulse in clocks of the timer, above 0. The output is low.
  void configure(std::uint32_t ticks) {
    stop();
    registers_.ccmr[1] = timer_ccmr::CompareMode<4>::bits(timer_ccmr::pwm_mode_2);
    registers_.arr = ticks;
    registers_.ccr[3] = 1;
    registers_.ccer = timer_ccer::Enable<4>::mask;
  }

  /// While a pulse is on, nothing. Any context, like stop().
  void start() { registers_.cr1 = timer_cr1::OnePulse::mask | timer_cr1::Enable::mask; }
  void stop() {
    registers_.cr1 = timer_cr1::OnePulse::mask;
    // The count decides on the level also while it stands.
    registers_.egr = timer_egr::Update::mask;
  }

 private:
  Registers& registers_;
};

}  // namespace kmax::drivers::stm32f4
