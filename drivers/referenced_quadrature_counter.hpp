#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

#include "drivers/line_look.hpp"
#include "drivers/quadrature_index_watch.hpp"

namespace kmax::drivers {

struct ReferencedQuadratureConfig {
  bool has_index = false;   ///< an index line is connected, and watched
  bool from_index = false;  ///< counts are referred to the index, once it is known
  std::uint32_t counts_per_turn = 8192;

  friend constexpr bool operator==(const ReferencedQuadratureConfig&,
                                   const ReferencedQuadratureConfig&) = default;
};

/// A quadrature counter's value, extended to 32 bits and referred to the encoder's index.
///
/// The count is 0 where the counter was at first. With `from_index` it is 0 at the middle of the index from
/// the first tick on in which the index is known (QuadratureIndexWatch: after a full crossing) and the axis
/// is not driven: the position jumps there, and that must never be under a force. Each such jump raises
/// `reference_generation`.
///
/// Between two calls the counter may move by less than half its range: 32767 for 16 bits.
///
/// Cost: about 13 Cortex-M4 instructions, and 17 more with an index line that is low.
template <std::unsigned_integral Counter = std::uint16_t>
class ReferencedQuadratureCounter {
 public:
  struct Reading {
    std::uint32_t count = 0;  ///< wraps at 2^32
    bool valid = false;       ///< the index line contradicts nothing
    bool referenced = false;  ///< counts are from the index, by now
    std::uint32_t reference_generation = 0;
  };

  /// While the axis is not driven. Nothing happens if all is as before. Otherwise the index is forgotten, and
  /// an encoder that was not to be believed is believed again; if counts were referred to the index, they are
  /// again those from the counter's beginning, which is one more generation.
  constexpr void configure(const ReferencedQuadratureConfig& config) {
    if (config == config_) return;
    config_ = config;
    index_.reset({.counts_per_turn = config.counts_per_turn});
    if (!referenced_) return;
    count_ += origin_;
    origin_ = 0;
    referenced_ = false;
    ++reference_generation_;
  }

  /// Once per tick. `counter`: the timer's. `index_line`: a function that gives the line's level at the same
  /// moment, asked only where there is one, and several times where it has just changed.
  template <std::predicate Line>
  constexpr Reading ISR_read(Counter counter, Line&& index_line, bool driving) {
    count_ = ISR_peek(counter);
    counter_ = counter;
    bool valid = true;
    if (config_.has_index) {
      bool high = index_line();
      if (index_.is_news(high)) [[unlikely]] {
        if (!ISR_stays([index_line, high] { return index_line() == high; })) high = !high;
      }
      valid = index_.ISR_plausible(count_, high);
      if (index_.learned() && config_.from_index && !referenced_ && !driving) [[unlikely]]
        refer_to_index();
    }
    return {count_, valid, referenced_, reference_generation_};
  }

  /// The count that ISR_read() would give; nothing changes.
  constexpr std::uint32_t ISR_peek(Counter counter) const {
    using Signed = std::make_signed_t<Counter>;
    const auto step = static_cast<Signed>(static_cast<Counter>(counter - counter_));
    return count_ + static_cast<std::uint32_t>(static_cast<std::int32_t>(step));
  }

 private:
  // Once after a start, and kept out of the tick's one function, whose registers it would take.
  [[gnu::noinline]] constexpr void refer_to_index() {
    origin_ = index_.index();
    count_ -= origin_;
    index_.ISR_shift_counts(origin_);
    referenced_ = true;
    ++reference_generation_;
  }

  ReferencedQuadratureConfig config_{};
  QuadratureIndexWatch index_{};
  Counter counter_ = 0;       ///< the timer's, of the last tick
  std::uint32_t count_ = 0;   ///< extended from it
  std::uint32_t origin_ = 0;  ///< what has been subtracted from it
  std::uint32_t reference_generation_ = 0;
  bool referenced_ = false;
};

}  // namespace kmax::drivers
