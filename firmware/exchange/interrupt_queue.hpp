#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace kmax::firmware {

/// A queue from one interrupt (single writer) to the main loop (single reader). `capacity` is a power of
/// two; when it is full the new item is dropped and counted, never the old ones.
template <typename Item, std::size_t capacity>
class InterruptQueue {
  static_assert((capacity & (capacity - 1)) == 0, "capacity must be a power of two");

 public:
  void ISR_push(const Item& item) {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == capacity) {
      overflows_.store(overflows_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return;
    }
    items_[head % capacity] = item;
    head_.store(head + 1, std::memory_order_release);
  }

  /// The interrupt's question before it lets more come.
  bool ISR_has_room() const {
    return head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire) < capacity;
  }

  bool empty() const {
    return tail_.load(std::memory_order_relaxed) == head_.load(std::memory_order_acquire);
  }
  /// False if there is nothing.
  bool pop(Item& item) {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    item = items_[tail % capacity];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  std::uint32_t overflows() const { return overflows_.load(std::memory_order_relaxed); }

 private:
  std::array<Item, capacity> items_{};
  std::atomic<std::uint32_t> head_{0}, tail_{0}, overflows_{0};
};

}  // namespace kmax::firmware
