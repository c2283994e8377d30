#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace kmax::firmware {

/// One value from the main loop (single writer) to an interrupt (single reader) that may preempt it: the
/// interrupt sees the old value or the new one, whole, and changes over between two ticks.
///
/// Two places: the reader holds one; the writer fills the other and then offers it. While an offer has not
/// been taken, the writer may replace it: it is withdrawn first, which is safe because the interrupt cannot
/// be interrupted by the main loop. No lock, no loop, no copying in the interrupt.
template <typename Value>
class Handover {
 public:
  explicit Handover(const Value& initial) : places_{initial, initial} {}

  /// Main loop.
  void offer(const Value& value) {
    offered_.store(false, std::memory_order_release);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    places_[1 - held_.load(std::memory_order_acquire)] = value;
    std::atomic_signal_fence(std::memory_order_seq_cst);
    offered_.store(true, std::memory_order_release);
  }

  /// Main loop: the last offer has been taken.
  bool taken() const { return !offered_.load(std::memory_order_acquire); }

  /// Interrupt: the value to use in this tick.
  const Value& ISR_take() {
    if (offered_.load(std::memory_order_acquire)) {
      held_.store(static_cast<std::uint8_t>(1 - held_.load(std::memory_order_relaxed)),
                  std::memory_order_relaxed);
      offered_.store(false, std::memory_order_release);
    }
    return ISR_current();
  }

  /// Interrupt: the value taken last.
  const Value& ISR_current() const { return places_[held_.load(std::memory_order_relaxed)]; }

 private:
  std::array<Value, 2> places_;
  std::atomic<std::uint8_t> held_{0};
  std::atomic<bool> offered_{false};
};

}  // namespace kmax::firmware
