#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace kmax::firmware {

/// A queue from the main loop (single writer) to one interrupt (single reader): InterruptQueue the other way
/// round. `capacity` is a power of two; when it is full nothing is taken, and the writer is told.
///
/// The interrupt does not hear of it by itself: the writer pends it.
template <typename Item, std::size_t capacity>
class QueueToInterrupt {
  static_assert((capacity & (capacity - 1)) == 0, "capacity must be a power of two");

 public:
  /// Main loop. False if there is no room.
  [[nodiscard]] bool push(const Item& item) {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == capacity) return false;
    items_[head % capacity] = item;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Main loop: as many more would be taken.
  std::size_t room() const {
    return capacity - (head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire));
  }

  /// False if there is nothing.
  bool ISR_pop(Item& item) {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    item = items_[tail % capacity];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// Forgets what waits.
  void ISR_clear() { tail_.store(head_.load(std::memory_order_acquire), std::memory_order_release); }

 private:
  std::array<Item, capacity> items_{};
  std::atomic<std::uint32_t> head_{0}, tail_{0};
};

}  // namespace kmax::firmware
