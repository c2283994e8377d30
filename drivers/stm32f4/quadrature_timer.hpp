#pragma once

#include <atomic>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>

#include "drivers/stm32f4/registers/timer.hpp"

// Incremental encoder on a timer's channels 1 (A) and 2 (B): RM0090, General-purpose timers, Encoder
// interface mode. Every edge of both signals counts, so there are four counts per line. A before B counts up.
//
// The counter wraps; `count()` is the raw value and whoever wants more bits extends it. TIM3 and TIM4 have 16
// bits, TIM2 and TIM5 32: `Counter` must match, since ARR is set to its largest value.
//
// Index signal (Z), once per turn, two ways to the same `take_index()`:
//   capture    Z is wired to channel 3 or 4 of the same timer (ODrive: PC9 = TIM3_CH4 for motor 0). The
//   hardware
//              copies the counter at the edge, later than A and B only by its own filter.
//   sampling   Z is on a pin without a timer (ODrive: PC15 for motor 1). Its EXTI handler calls
//              `ISR_sample_index`, which is late by the interrupt's latency: 12 cycles, and longer while a
//              handler of the same or a higher priority runs. At 1 M counts/s each microsecond is a count.
// Two index edges between two calls of `take_index` count as one: the later.
//
// Filter: a level is believed when it has been seen for `input_filter_clocks(code)` timer clocks, so edges of
// one signal that are closer together are lost. Code 4 is 12 clocks, 143 ns at 84 MHz: up to 3.5 M lines/s.
//
// Contexts: `configure` with the interrupts off; `count` anywhere; `take_index` in one context, which may be
// interrupted by the one that samples.
//
// Cost: `count` is one load. `take_index` is one or two loads.

namespace kmax::drivers::stm32f4 {

/// Timer clocks for which an input must be steady, by the code of ICxF (0 to 15; CR1.CKD = 0).
constexpr std::uint32_t input_filter_clocks(std::uint8_t code) {
  constexpr std::uint16_t clocks[16] = {0,     2,     4,      8,      2 * 6,  2 * 8,  4 * 6,  4 * 8,
                                        8 * 6, 8 * 8, 16 * 5, 16 * 6, 16 * 8, 32 * 5, 32 * 6, 32 * 8};
  return clocks[code & 0xFU];
}

struct IndexCapture {
  std::uint8_t channel = 4;  // 3 or 4
  bool falling_edge = false;
};

struct QuadratureTimerConfig {
  std::uint8_t input_filter = 4;  // 0 to 15, for A, B and a captured index
  bool reversed = false;          // counts the other way round
  std::optional<IndexCapture> index_capture = std::nullopt;
};

template <typename Registers = TimerRegisters, std::unsigned_integral Counter = std::uint16_t>
class QuadratureTimer {
  static_assert(sizeof(Counter) == 2 || sizeof(Counter) == 4, "timers have 16 or 32 bits");
  static_assert(std::atomic<Counter>::is_always_lock_free);

 public:
  explicit constexpr QuadratureTimer(Registers& registers) : registers_(registers) {}

  /// Starts counting from 0. False, and nothing touched, when the filter code or the channel does not exist.
  [[nodiscard]] bool configure(const QuadratureTimerConfig& config) {
    if (config.input_filter > 15) return false;
    if (config.index_capture && config.index_capture->channel != 3 && config.index_capture->channel != 4)
      return false;

    registers_.cr1 = 0;
    registers_.ccer = 0;  // CCxS can be written only while the channels are off
    registers_.cr2 = 0;
    registers_.smcr = 0;
    registers_.dier = 0;
    registers_.ccmr[0] = input<1>(config.input_filter) | input<2>(config.input_filter);
    registers_.ccmr[1] = 0;
    capture_channel_ = 0;
    std::uint32_t channels = timer_ccer::Polarity<1>::bits(config.reversed ? 1 : 0);
    if (config.index_capture) {
      capture_channel_ = config.index_capture->channel;
      channels |= capture_channel_ == 3 ? configure_capture<3>(config) : configure_capture<4>(config);
    }
    registers_.psc = 0;
    registers_.arr = std::numeric_limits<Counter>::max();
    // The direction is writable only outside encoder mode, and UG would load ARR if the last one were down.
    registers_.cr1 = timer_cr1::UpdateRequestSource::mask;
    registers_.egr = timer_egr::Update::mask;  // loads the prescaler, clears the counter
    registers_.sr = 0;
    registers_.smcr = timer_smcr::SlaveMode::bits(timer_smcr::slave_encoder_both_inputs);
    index_seen_.store(false, std::memory_order_relaxed);
    registers_.ccer = channels;
    registers_.cr1 = timer_cr1::UpdateRequestSource::mask | timer_cr1::Enable::mask;
    return true;
  }

  Counter count() const { return static_cast<Counter>(static_cast<std::uint32_t>(registers_.cnt)); }

  /// For the EXTI handler of an index pin that no timer captures.
  void ISR_sample_index() {
    index_count_.store(count(), std::memory_order_relaxed);
    index_seen_.store(true, std::memory_order_release);
  }

  /// The counter at the last index edge, once for each edge (a sampling that interrupts this call may be
  /// handed out twice, with the same count).
  std::optional<Counter> take_index() {
    if (capture_channel_ == 3) return take_capture<3>();
    if (capture_channel_ == 4) return take_capture<4>();
    if (!index_seen_.load(std::memory_order_acquire)) return std::nullopt;
    // Cleared before the count is read: a sampling in between is then reported, not lost.
    index_seen_.store(false, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    return index_count_.load(std::memory_order_relaxed);
  }

 private:
  template <unsigned channel>
  static constexpr std::uint32_t input(std::uint8_t filter) {
    return timer_ccmr::Selection<channel>::bits(timer_ccmr::input_of_own_pin) |
           timer_ccmr::InputFilter<channel>::bits(filter);
  }

  template <unsigned channel>
  std::uint32_t configure_capture(const QuadratureTimerConfig& config) {
    registers_.ccmr[1] = input<channel>(config.input_filter);
    return timer_ccer::Enable<channel>::mask |
           timer_ccer::Polarity<channel>::bits(config.index_capture->falling_edge ? 1 : 0);
  }

  template <unsigned channel>
  std::optional<Counter> take_capture() {
    if (timer_sr::CaptureCompare<channel>::read(registers_.sr) == 0) return std::nullopt;
    // Reading CCRx clears CCxIF.
    return static_cast<Counter>(static_cast<std::uint32_t>(registers_.ccr[channel - 1]));
  }

  Registers& registers_;
  std::uint8_t capture_channel_ = 0;  // 0 = none
  std::atomic<Counter> index_count_{0};
  std::atomic<bool> index_seen_{false};
};

}  // namespace kmax::drivers::stm32f4
