#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace kmax::control {

// Extends a free-running 16-bit or 32-bit hardware counter (a timer in quadrature mode, an absolute
// single-turn angle of exactly 2^n counts) to a 64-bit count that never wraps: 2^63 counts of 0.1 um are 6
// light-minutes.
//
// Half-range step rule: between two calls the counter must move by less than half of its range. The movement
// is read as the one value in [-2^(n-1), 2^(n-1) - 1] that is congruent to the difference of the raw values,
// so a move of exactly half the range is read as negative, and a longer one is read as the shorter way round:
// the error is then a whole multiple of 2^n counts and cannot be detected here. At 20 kHz a 16-bit counter
// follows 655 million counts/s. The rule holds everywhere on the raw scale: 0xFFFF to 0, and 0x7FFFFFFF to
// 0x80000000 (INT32_MIN).
//
// Cost: 13 Cortex-M4 instructions. No failure.
template <std::unsigned_integral Counter>
class CountExtender {
  static_assert(sizeof(Counter) == 2 || sizeof(Counter) == 4, "a 16-bit or a 32-bit counter");
  using Step = std::make_signed_t<Counter>;

 public:
  // Without a count the raw value itself is taken as signed: a counter that was cleared at the home position
  // and has since moved back by one (0xFFFF) starts at -1.
  void reset(Counter raw) { reset(raw, static_cast<Step>(raw)); }

  // The present raw value stands for `count`.
  void reset(Counter raw, std::int64_t count) {
    raw_ = raw;
    count_ = count;
  }

  std::int64_t update(Counter raw) {
    count_ = peek(raw);
    raw_ = raw;
    return count_;
  }

  // What update() would give; nothing changes.
  std::int64_t peek(Counter raw) const {
    // The inner cast undoes the promotion of 16-bit operands to int; the outer one is modular since C++20.
    return count_ + static_cast<Step>(static_cast<Counter>(raw - raw_));
  }

  std::int64_t count() const { return count_; }

 private:
  std::int64_t count_ = 0;
  Counter raw_ = 0;
};

}  // namespace kmax::control
