#pragma once

#include <cstdint>

namespace kmax::drivers {

struct QuadratureIndexConfig {
  std::uint32_t counts_per_turn = 8192;  ///< >= 4
  std::int32_t tolerance = 4;            ///< counts around the index in which the line may be high
};

/// Tells a quadrature encoder whose cable has come off from one that stands still.
///
/// Its lines are pulled up on the board, so an open cable reads A = B = Z = 1: the count stays, which alone
/// looks like a handle at rest, but the index line is high where no index is. Where the index is, is learned
/// when the line has been high and falls again near the same count: a cable that comes off never does that.
/// From then on a high line anywhere else is wrong at the first look. Before that, only a line that stays
/// high while the count leaves the tolerance is.
///
/// So a cable that comes off before the index has once been passed is not seen, and neither is one that comes
/// off on the index.
///
/// Once wrong it stays wrong until reset(): edges have been lost, and with them the position.
///
/// Cost: 12 Cortex-M4 instructions while the line is low, 25 (one division) while it is high.
class QuadratureIndexWatch {
 public:
  explicit constexpr QuadratureIndexWatch(const QuadratureIndexConfig& config = {}) : config_(config) {}

  constexpr void reset(const QuadratureIndexConfig& config) {
    config_ = config;
    learned_ = failed_ = high_ = false;
  }

  /// `count`: free-running. `index_line`: its level at the same moment. False: the encoder is not to be
  /// believed.
  constexpr bool ISR_plausible(std::uint32_t count, bool index_line) {
    if (!index_line) {
      if (high_ && !learned_ && !failed_ && distance_from(index_, count) <= config_.tolerance)
        learned_ = true;
      high_ = false;
      return !failed_;
    }
    if (!learned_ && !high_) index_ = count;
    high_ = true;
    if (distance_from(index_, count) > config_.tolerance) failed_ = true;
    return !failed_;
  }

  constexpr bool learned() const { return learned_; }

 private:
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
  std::uint32_t index_ = 0;
  bool learned_ = false, failed_ = false, high_ = false;
};

}  // namespace kmax::drivers
