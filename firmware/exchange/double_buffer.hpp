#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace kmax::firmware {

/// A double buffer for the newest value from the main loop to an interrupt: one writer, one reader, which may
/// preempt the writer and which the writer cannot preempt, on one core.
///
/// The reader holds one of two places, the writer fills the other and offers it. Guarantees, at whatever
/// instruction the interrupt comes: ISR_take() gives the value before an offer or the offered one, each
/// whole; a value that has been taken does not change until the next ISR_take(); the last offer is taken in
/// the end, those before it may be skipped. No lock, no loop, and in the interrupt no copy.
template <typename Value>
class DoubleBuffer {
 public:
  explicit DoubleBuffer(const Value& initial) : places_{initial, initial} {}

  /// Main loop. An offer that has not been taken is withdrawn first and replaced; since the writer cannot
  /// preempt the reader, the place is free from then on. Cost: one copy.
  void offer(const Value& value) {
    offered_.store(false, std::memory_order_release);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    places_[1 - held_.load(std::memory_order_acquire)] = value;
    std::atomic_signal_fence(std::memory_order_seq_cst);
    offered_.store(true, std::memory_order_release);
  }

  /// Main loop: the last offer has been taken.
  bool taken() const { return !offered_.load(std::memory_order_acquire); }

  /// Interrupt: changes over to an offered value, and gives the one to use in this tick. Constant time.
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
