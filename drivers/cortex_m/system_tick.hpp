#pragma once

#include <cstdint>

#include "drivers/cortex_m/registers.hpp"

// SysTick as the source of the periodic tick, and a microsecond clock made of the tick count and the
// counter's value. PM0214, system timer; ICSR in the system control block.
//
// The counter runs from `reload` down to 0 and starts again. It is the step from 1 to 0 that raises the
// interrupt, so 0 is the first cycle of a period and not the last: the time since the tick is 0 at VAL = 0
// and reload + 1 - VAL otherwise.
//
// `now_us` may be called from any context that does not outrank the tick interrupt, and from that interrupt
// itself after `ISR_count`. Also with interrupts masked, as long as that lasts less than a period: a tick
// that is pending but not yet counted is added. A context that outranks the tick (NMI, a fault) may read one
// period too little if it strikes between the handler's entry and `ISR_count`.
//
// Time wraps after 2^32 us (71.6 min): take differences in std::uint32_t. A tick that is blocked for more
// than a whole period is lost to the clock.
//
// Cost of now_us: at most six loads and two 32-bit divisions (by hardware), no loop.

namespace kmax::drivers::cortex_m {

template <typename Registers = SystemTickRegisters, typename Scb = ScbRegisters>
class SystemTick {
 public:
  constexpr SystemTick(Registers& registers, const Scb& scb) : registers_(registers), scb_(scb) {}

  /// Starts ticking at `tick_hz` from the processor clock. False, and nothing touched, unless the core clock
  /// is a whole number of MHz, the tick period a whole number of microseconds, and the count fits the 24-bit
  /// counter.
  [[nodiscard]] bool start(std::uint32_t core_clock_hz, std::uint32_t tick_hz) {
    constexpr std::uint32_t million = 1'000'000;
    if (core_clock_hz % million != 0) return false;
    if (tick_hz == 0 || million % tick_hz != 0) return false;
    const std::uint32_t cycles = core_clock_hz / tick_hz;
    if (cycles < 2 || cycles - 1 > system_tick_load::Reload::maximum) return false;

    cycles_per_period_ = cycles;
    cycles_per_us_ = core_clock_hz / million;
    period_us_ = million / tick_hz;
    registers_.ctrl = 0;
    registers_.load = cycles - 1;
    registers_.val = 0;  // any write sets it to 0; the first cycle then loads the reload value
    registers_.ctrl = system_tick_ctrl::Enable::mask | system_tick_ctrl::TickInterrupt::mask |
                      system_tick_ctrl::ProcessorClock::mask;
    return true;
  }

  /// First statement of the tick interrupt handler.
  void ISR_count() { tick_us_ = tick_us_ + period_us_; }

  /// Microseconds since `start`, modulo 2^32; never goes back.
  std::uint32_t now_us() const {
    const std::uint32_t counted = tick_us_;
    std::uint32_t elapsed = elapsed_us();
    if (tick_is_pending()) {
      // The counter was read before or after the step to 0; only a second reading is certain to be after it.
      elapsed = period_us_ + elapsed_us();
    }
    // A tick that was counted between the reads makes them inconsistent, but then its own time is the answer:
    // it lies between the beginning and the end of this call.
    return tick_us_ == counted ? counted + elapsed : tick_us_;
  }

 private:
  std::uint32_t elapsed_us() const {
    const auto value = static_cast<std::uint32_t>(registers_.val);
    return value == 0 ? 0 : (cycles_per_period_ - value) / cycles_per_us_;
  }

  bool tick_is_pending() const {
    return (static_cast<std::uint32_t>(scb_.icsr) & scb_icsr::SystemTickPending::mask) != 0;
  }

  Registers& registers_;
  const Scb& scb_;
  std::uint32_t cycles_per_period_ = 1;
  std::uint32_t cycles_per_us_ = 1;
  std::uint32_t period_us_ = 0;
  /// Volatile so that the compiler keeps its order relative to the register reads; one core, one writer.
  volatile std::uint32_t tick_us_ = 0;
};

}  // namespace kmax::drivers::cortex_m
