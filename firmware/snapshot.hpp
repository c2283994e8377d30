#pragma once

#include <atomic>
#include <concepts>
#include <cstdint>

namespace kmax::firmware {

/// The latest value from an interrupt (single writer) to the main loop (single reader), never torn: the
/// reader repeats its copy when the interrupt came in between. The interrupt never waits; the reader's
/// loop ends because a tick is much longer than a copy.
template <typename Value>
class Snapshot {
 public:
  void ISR_publish(const Value& value) {
    ISR_publish([&value](Value& place) { place = value; });
  }

  /// The same without a copy: `fill` writes the value where it is kept.
  template <typename Fill>
  requires std::invocable<Fill, Value&>
  void ISR_publish(Fill fill) {
    const std::uint32_t sequence = sequence_.load(std::memory_order_relaxed);
    sequence_.store(sequence + 1, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    fill(value_);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    sequence_.store(sequence + 2, std::memory_order_release);
  }

  Value read() const {
    for (;;) {
      const std::uint32_t before = sequence_.load(std::memory_order_acquire);
      std::atomic_signal_fence(std::memory_order_seq_cst);
      const Value copy = value_;
      std::atomic_signal_fence(std::memory_order_seq_cst);
      if ((before & 1u) == 0 && sequence_.load(std::memory_order_acquire) == before) return copy;
    }
  }

 private:
  Value value_{};
  std::atomic<std::uint32_t> sequence_{0};
};

}  // namespace kmax::firmware
