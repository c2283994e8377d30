#pragma once

#include <atomic>
#include <cstdint>

namespace kmax::firmware {

/// A flag that interrupts raise and the main loop takes, on one core.
///
/// Guarantees: what an interrupt wrote before it raised the flag is there when take() has returned true.
/// Raised several times before it is taken, it is taken once. What is raised while it is taken is not lost:
/// the main loop has not yet looked at what it is about.
///
/// Cost: take() of one that is not raised: a load and a compare. An exchange would be six
/// instructions more, in each of eight wakings in 200 us.
class InterruptSignal {
 public:
  void ISR_raise() {
    std::atomic_signal_fence(std::memory_order_seq_cst);
    raised_.store(1, std::memory_order_relaxed);
  }
  [[gnu::always_inline]] bool take() {
    if (raised_.load(std::memory_order_relaxed) == 0) return false;
    raised_.store(0, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    return true;
  }

 private:
  std::atomic<std::uint8_t> raised_{0};
};

}  // namespace kmax::firmware
