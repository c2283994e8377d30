#pragma once

#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace kmax::firmware {

/// A seqlock for the newest value from an interrupt to the main loop: one writer, which may preempt the
/// reader at any instruction and is never preempted by it, and one reader, on one core.
///
/// Guarantees: read() gives one published value whole, the newest of the moment at which it returns; before
/// the first publication an empty one. The writer never waits; the reader copies again when a publication
/// came in between, and ends since publications are much further apart than a copy takes. The value must be
/// trivially copyable in effect: a torn copy is made and thrown away.
template <typename Value>
class Seqlock {
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
    sequence_.store(sequence + 2, std::memory_order_relaxed);
  }

  Value read() const {
    Value copy;
    read(copy);
    return copy;
  }

  /// The same without a second copy, for who keeps the value.
  void read(Value& copy) const {
    std::uint32_t before = 0;
    do {
      before = sequence_.load(std::memory_order_acquire);
      std::atomic_signal_fence(std::memory_order_seq_cst);
      copy_to(copy);
      std::atomic_signal_fence(std::memory_order_seq_cst);
    } while ((before & 1u) != 0 || sequence_.load(std::memory_order_acquire) != before);
  }

 private:
  /// For large values compilers call memcpy, which takes two instructions a word; blocks that are known to be
  /// short and aligned take one for two words.
  void copy_to(Value& copy) const {
    if constexpr (!std::is_trivially_copyable_v<Value>) {
      copy = value_;
    } else {
      constexpr std::size_t block = 64;
      const auto* from = static_cast<const char*>(__builtin_assume_aligned(&value_, alignof(Value)));
      auto* to = static_cast<char*>(__builtin_assume_aligned(&copy, alignof(Value)));
      std::size_t at = 0;
      for (; at + block <= sizeof(Value); at += block) __builtin_memcpy(to + at, from + at, block);
      __builtin_memcpy(to + at, from + at, sizeof(Value) % block);
    }
  }

  Value value_{};
  std::atomic<std::uint32_t> sequence_{0};
};

}  // namespace kmax::firmware
