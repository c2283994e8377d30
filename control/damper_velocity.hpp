#pragma once

#include <array>
#include <cstdint>

namespace kmax::control {

inline constexpr std::int32_t damper_window_max = 16;

/// Velocity as the difference over the last few samples: with a window of one the backward difference, whose
/// delay is half a sample and whose quantum is a count per period; n samples divide both the quantum and what
/// an estimator can follow by n. For a damper, which needs little delay more than it needs a quiet velocity.
///
/// window 1 to 16 samples, others are brought into it; count_length in metres per count, > 0; period in
/// seconds, > 0; output m/s, always finite. With another window or step of the counts, and after forget(),
/// the handle counts as having stood still so far. A jump of 2^31 counts or more within a window reads as
/// less. Cost: at most 20 Cortex-M4 instructions.
template <typename Scalar>
class DamperVelocity {
 public:
  struct Coefficients {
    std::uint32_t window = 1;  ///< samples
    std::uint32_t key = 0;     ///< window and step: update() looks for a change of it
    Scalar scale = 0;          ///< m/s for one count over the window
  };

  /// `step`: counts that positions are multiples of, >= 1.
  static constexpr Coefficients prepare(std::int32_t window, Scalar period, Scalar count_length,
                                        std::int32_t step) {
    const std::int32_t within = window < 1 ? 1 : window < damper_window_max ? window : damper_window_max;
    const auto samples = static_cast<std::uint32_t>(within);
    // Steps up to 2^27 are distinguished.
    return {samples, static_cast<std::uint32_t>(step) << 5 | samples,
            count_length / (period * static_cast<Scalar>(within))};
  }

  void forget() { key_ = no_key; }

  Scalar update(const Coefficients& c, std::int64_t count) {
    if (c.key != key_) [[unlikely]] {
      key_ = c.key;
      counts_.fill(static_cast<std::uint32_t>(count));
    }
    head_ = (head_ + 1) & (ring - 1);
    counts_[head_] = static_cast<std::uint32_t>(count);
    const std::uint32_t before = counts_[(head_ - c.window) & (ring - 1)];
    return static_cast<Scalar>(static_cast<std::int32_t>(counts_[head_] - before)) * c.scale;
  }

 private:
  static constexpr std::uint32_t ring = 32;   // a power of two above the window
  static constexpr std::uint32_t no_key = 0;  // a window is never 0
  std::array<std::uint32_t, ring> counts_{};  // low words
  std::uint32_t head_{};
  std::uint32_t key_ = no_key;
};

}  // namespace kmax::control
