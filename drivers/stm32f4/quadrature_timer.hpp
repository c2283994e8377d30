#pragma once

#include <concepts>
#include <cstdint>
#include <limits>

#include "drivers/stm32f4/registers/timer.hpp"

// Incremental encoder on a timer's channels 1 (A) and 2 (B): RM0090, General-purpose timers, Encoder
// interface mode. Every edge of both signals counts, so there are four counts per line. A before B counts up.
//
// The counter wraps; `count()` is the raw value and whoever wants more bits extends it. TIM3 and TIM4 have 16
// bits, TIM2 and TIM5 32: `Counter` must match, since ARR is set to its largest value.
//
// The index signal (Z) is read as a level at the tick (drivers::QuadratureIndexWatch).
//
// Filter: a level is believed when it has been seen for as many timer clocks as RM0090 has for the code
// (TIMx_CCMR1, IC1F), so edges of one signal that are closer together are lost. Code 11 is 96 clocks, 1.14 us
// at 84 MHz: longer than what a bridge's edges make, and up to 440,000 lines/s.
//
// Contexts: `configure` with the interrupts off; `count` anywhere. Cost: one load.

namespace kmax::drivers::stm32f4 {

struct QuadratureTimerConfig {
  std::uint8_t input_filter = 11;  // 0 to 15
  bool reversed = false;           // counts the other way round
};

template <typename Registers = TimerRegisters, std::unsigned_integral Counter = std::uint16_t>
class QuadratureTimer {
  static_assert(sizeof(Counter) == 2 || sizeof(Counter) == 4, "timers have 16 or 32 bits");

 public:
  explicit constexpr QuadratureTimer(Registers& registers) : registers_(registers) {}

  /// Starts counting from 0. False, and nothing touched, when the filter code does not exist.
  [[nodiscard]] bool configure(const QuadratureTimerConfig& config) {
    if (config.input_filter > 15) return false;
    registers_.cr1 = 0;
    registers_.ccer = 0;  // CCxS can be written only while the channels are off
    registers_.cr2 = 0;
    registers_.smcr = 0;
    registers_.dier = 0;
    registers_.ccmr[0] = input<1>(config.input_filter) | input<2>(config.input_filter);
    registers_.ccmr[1] = 0;
    registers_.psc = 0;
    registers_.arr = std::numeric_limits<Counter>::max();
    // The direction is writable only outside encoder mode, and UG would load ARR if the last one were down.
    registers_.cr1 = timer_cr1::UpdateRequestSource::mask;
    registers_.egr = timer_egr::Update::mask;  // loads the prescaler, clears the counter
    registers_.sr = 0;
    registers_.smcr = timer_smcr::SlaveMode::bits(timer_smcr::slave_encoder_both_inputs);
    registers_.ccer = timer_ccer::Polarity<1>::bits(config.reversed ? 1 : 0);
    registers_.cr1 = timer_cr1::UpdateRequestSource::mask | timer_cr1::Enable::mask;
    return true;
  }

  Counter count() const { return static_cast<Counter>(static_cast<std::uint32_t>(registers_.cnt)); }

 private:
  template <unsigned channel>
  static constexpr std::uint32_t input(std::uint8_t filter) {
    return timer_ccmr::Selection<channel>::bits(timer_ccmr::input_of_own_pin) |
           timer_ccmr::InputFilter<channel>::bits(filter);
  }

  Registers& registers_;
};

}  // namespace kmax::drivers::stm32f4
