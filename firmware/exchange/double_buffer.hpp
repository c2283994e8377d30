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
/// the end, those before it may be skipped. No lock, no loop, and in the interrupt no copy. What orders the
/// accesses is for the compiler alone: one core sees its own in their order.
template <typename Value>
class DoubleBuffer {
 public:
  explicit DoubleBuffer(const Value& initial) : places_{initial, initial} {
    held_.store(&places_[0], std::memory_order_relaxed);
  }

  /// Main loop. An offer that has not been taken is withdrawn first and replaced; since the writer cannot
  /// preempt the reader, the place is free from then on. Cost: one copy.
  void offer(const Value& value) {
    offered_.store(false, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    *free_place(held_.load(std::memory_order_relaxed)) = value;
    std::atomic_signal_fence(std::memory_order_seq_cst);
    offered_.store(true, std::memory_order_relaxed);
  }

  /// Main loop: the last offer has been taken.
  bool taken() const {
    const bool offered = offered_.load(std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    return !offered;
  }

  /// Interrupt: changes over to an offered value, and gives the one to use in this tick. Constant time.
  const Value& ISR_take() {
    if (offered_.load(std::memory_order_relaxed)) [[unlikely]] {
      std::atomic_signal_fence(std::memory_order_seq_cst);
      held_.store(free_place(held_.load(std::memory_order_relaxed)), std::memory_order_relaxed);
      std::atomic_signal_fence(std::memory_order_seq_cst);
      offered_.store(false, std::memory_order_relaxed);
    }
    return ISR_current();
  }

  /// Interrupt: the value taken last.
  const Value& ISR_current() const { return *held_.load(std::memory_order_relaxed); }

 private:
  Value* free_place(const Value* held) { return held == &places_[0] ? &places_[1] : &places_[0]; }

  // What each tick reads comes first, where a load reaches it.
  std::atomic<const Value*> held_{nullptr};
  std::atomic<bool> offered_{false};
  std::array<Value, 2> places_;
};

}  // namespace kmax::firmware
