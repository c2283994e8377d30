#pragma once

#include <algorithm>
#include <cstdint>

namespace kmax::drivers {

struct QuadratureIndexConfig {
  std::uint32_t counts_per_turn = 8192;  ///< >= 4
  std::int32_t tolerance = 4;            ///< counts beyond the index in which the line may still be high
  std::int32_t widest = 16;              ///< counts, >= 1: no index is wider (one line is four counts)
};

/// Where a quadrature encoder's index is, and whether the encoder's cable has come off.
///
/// The lines are pulled up on the board, so an open cable reads A = B = Z = 1: the count stays, which alone
/// looks like a handle at rest, but the index line is high where no index is.
///
/// The index is learned from a full crossing: the line was low on one side, high in between, and falls on the
/// other side. A handle that dips into the index and comes back, or that starts on it, has seen one edge
/// only and teaches nothing. index() is the middle between the two edges, each taken half-way between the
/// last look at one level and the first at the other: the same from both sides. At one count per look it is
/// within half a count of the middle; at n counts per look within n/2, since the edges are known no better. A
/// crossing in which the two low looks are more than twice `widest` apart is not used.
///
/// What a high line says of the cable:
///   line never fallen yet          wrong when it has been high over more than `widest` counts
///   fallen without a full crossing wrong when farther than `widest` + `tolerance` from where it was high
///   learned                        wrong when more than `tolerance` beyond the index, whose width is known
/// The last two need `looks_to_doubt` looks in a row: one is interference. They find a cable that comes off
/// at the last of these. One that comes off before the line has once been high and fallen is not seen, and
/// neither is one that comes off on the index.
///
/// Once wrong it stays wrong until reset(): edges have been lost, and with them the position.
///
/// Until the index is learned, a line that has just changed must be proved so (is_news(), line_look.hpp):
/// interference would teach a place where no index is.
///
/// Cost: about 10 Cortex-M4 instructions while the line is low, 30 (one division) while it is high.
class QuadratureIndexWatch {
 public:
  explicit constexpr QuadratureIndexWatch(const QuadratureIndexConfig& config = {}) : config_(config) {}

  constexpr void reset(const QuadratureIndexConfig& config) { *this = QuadratureIndexWatch{config}; }

  /// `count`: free-running. `index_line`: its level at the same moment. False: the encoder is not to be
  /// believed.
  constexpr bool ISR_plausible(std::uint32_t count, bool index_line) {
    if (!index_line) {
      if (high_) [[unlikely]] {
        high_ = false;
        doubts_ = 0;
        if (!learned_ && !failed_) learn(count);
      }
      low_at_ = count;
      low_seen_ = true;
      return !failed_;
    }
    if (!learned_) [[unlikely]]
      extend(count);
    high_ = true;
    if (zone_known_ && distance_from(index_, count) > reach_ && ++doubts_ >= looks_to_doubt) failed_ = true;
    return !failed_;
  }

  static constexpr unsigned looks_to_doubt = 3;

  /// A line of this level would be news from which the index is learned.
  constexpr bool is_news(bool high) const { return !learned_ && high != high_; }
  constexpr bool learned() const { return learned_; }

  /// Count at which the middle of the index is, once learned.
  constexpr std::uint32_t index() const { return index_; }

  /// Counts are given less `by` from now on.
  constexpr void ISR_shift_counts(std::uint32_t by) {
    index_ -= by;
    low_at_ -= by;
    rose_at_ -= by;
  }

 private:
  // Both before the index is known only, and kept out of the tick's one function, of which there is a copy
  // for each axis: inlined they are 1 KiB of the image.

  /// The counts at which the line is high. Counts here are from where it rose: the last low look, or
  /// the first look of all.
  [[gnu::noinline, gnu::cold]] constexpr void extend(std::uint32_t count) {
    if (!high_) {
      from_low_ = low_seen_;
      rose_at_ = low_seen_ ? low_at_ : count;
      lowest_ = highest_ = static_cast<std::int32_t>(count - rose_at_);
    }
    const auto moved = static_cast<std::int32_t>(count - rose_at_);
    lowest_ = std::min(lowest_, moved);
    highest_ = std::max(highest_, moved);
    if (highest_ - lowest_ >= config_.widest) failed_ = true;
  }

  /// The line has fallen.
  [[gnu::noinline, gnu::cold]] constexpr void learn(std::uint32_t count) {
    const auto out = static_cast<std::int32_t>(count - rose_at_);
    if (from_low_ && is_crossing(out)) {
      const std::int32_t below = std::min<std::int32_t>(0, out), above = std::max<std::int32_t>(0, out);
      // To the nearest count; a half goes up, from whichever side it is crossed.
      const std::int32_t middle = (below + lowest_ + highest_ + above + 2) >> 2;
      // All counts that can belong to the index, seen high or not seen at all.
      const std::int32_t down = middle - std::min(lowest_, below + 1);
      const std::int32_t up = std::max(highest_, above - 1) - middle;
      take(middle, std::max(down, up));
      learned_ = true;
    } else if (!zone_known_) {
      take((lowest_ + highest_) >> 1, config_.widest);
    }
  }

  /// An edge may lie within a count, which is then seen low and high. If no other count was high, nothing
  /// tells a crossing from a touch.
  constexpr bool is_crossing(std::int32_t out) const {
    if (std::max(out, -out) > 2 * config_.widest) return false;
    if (lowest_ > 0 && out > highest_) return true;
    if (highest_ < 0 && out < lowest_) return true;
    if (lowest_ == highest_) return false;
    return (lowest_ >= 0 && out >= highest_) || (highest_ <= 0 && out <= lowest_);
  }

  constexpr void take(std::int32_t middle, std::int32_t half_width) {
    index_ = rose_at_ + static_cast<std::uint32_t>(middle);
    reach_ = half_width + config_.tolerance;
    zone_known_ = true;
  }

  /// Counts to the nearest whole number of turns from `origin`.
  constexpr std::int32_t distance_from(std::uint32_t origin, std::uint32_t count) const {
    const auto moved = static_cast<std::int32_t>(count - origin);
    const std::uint32_t magnitude =
        moved < 0 ? 0U - static_cast<std::uint32_t>(moved) : static_cast<std::uint32_t>(moved);
    const std::uint32_t rest = magnitude % config_.counts_per_turn;
    const std::uint32_t other = config_.counts_per_turn - rest;
    return static_cast<std::int32_t>(rest < other ? rest : other);
  }

  QuadratureIndexConfig config_;
  std::uint32_t index_{};              ///< middle of where the line may be high
  std::int32_t reach_{};               ///< counts from there in which it may be
  std::uint32_t low_at_{};             ///< of the last low look
  std::uint32_t rose_at_{};            ///< of the last low look before the line rose
  std::int32_t lowest_{}, highest_{};  ///< from rose_at_: counts with a high line
  unsigned doubts_ = 0;                ///< high looks in a row where no index is
  bool learned_ = false, failed_ = false, high_ = false;
  bool low_seen_ = false, from_low_ = false, zone_known_ = false;
};

}  // namespace kmax::drivers
