#pragma once
// Velocity estimators that were tried against FOAW (docs/velocity_estimators.md): what each does, in float as
// in the image. Each takes the steps moved since the last sample and gives steps per sample. None is in the
// image.

#include <array>
#include <cstdint>

#include "control/edge_period_velocity.hpp"
#include "control/foaw_velocity.hpp"

namespace kmax::studies {

/// The reference: the image's own FOAW with the best fit. `every`: only every n-th sample is looked at, with
/// what was moved since, and the output is held in between.
template <std::int32_t every>
class HeldFoaw {
 public:
  float update(std::int32_t steps) {
    moved_ += steps;
    if (++turn_ < every) return velocity_;
    turn_ = 0;
    velocity_ = foaw_.estimate<control::FoawFit::best>(coefficients, foaw_.push(moved_));
    moved_ = 0;
    return velocity_;
  }

 private:
  static constexpr control::FoawVelocity<float>::Coefficients coefficients{1, 16, 1.0F / every, every};
  control::FoawVelocity<float> foaw_;
  std::int32_t moved_ = 0, turn_ = 0;
  float velocity_ = 0.0F;
};

/// FOAW from the other end, which is incremental: a line from the window's OLDEST sample must stay within one
/// step of all later ones. The slopes that do so are a cone; each sample narrows it, in a time that does not
/// depend on the window. When the cone closes, a younger window takes its place; so it does when the window
/// has reached its longest. The velocity is the middle of the cone, which bounds the error by half its width.
template <std::int32_t longest>
class TwoCones {
 public:
  float update(std::int32_t steps) {
    narrow(old_, steps);
    narrow(young_, steps);
    if (old_.low > old_.high || old_.length == longest) {
      old_ = young_;
      young_ = {};
      // Both bent: what is left is the newest interval.
      if (old_.low > old_.high) {
        old_ = {};
        narrow(old_, steps);
      }
    } else if (young_.low > young_.high || (young_.length > longest / 2 && old_.length < longest / 2)) {
      young_ = {};
    }
    return 0.5F * (old_.low + old_.high);
  }

 private:
  struct Cone {
    std::int32_t moved = 0, length = 0;
    float low = -1e9F, high = 1e9F;
  };
  static constexpr std::array<float, longest + 1> inverses = [] {
    std::array<float, longest + 1> table{};
    for (std::int32_t n = 1; n <= longest; ++n)
      table[static_cast<std::size_t>(n)] = 1.0F / static_cast<float>(n);
    return table;
  }();
  [[gnu::always_inline]] static void narrow(Cone& cone, std::int32_t steps) {
    cone.moved += steps;
    const float inverse = inverses[static_cast<std::size_t>(++cone.length)];
    const float slope = static_cast<float>(cone.moved) * inverse;
    if (slope - inverse > cone.low) cone.low = slope - inverse;
    if (slope + inverse < cone.high) cone.high = slope + inverse;
  }
  Cone old_, young_;
};

/// A tracking loop (steady Kalman filter) that knows what a count says: the handle is within half a step of
/// it. A prediction in there is left alone, one outside is moved to the border and the velocity by a tenth of
/// what was missing;
class IntervalTracking {
 public:
  float update(std::int32_t steps) {
    ahead_ += velocity_ - static_cast<float>(steps);
    const float clipped = ahead_ > 0.5F ? 0.5F : ahead_ < -0.5F ? -0.5F : ahead_;
    velocity_ += 0.1F * (clipped - ahead_);
    ahead_ = clipped;
    return velocity_;
  }

 private:
  float ahead_ = 0.0F, velocity_ = 0.0F;
};

/// The time between edges: the image's own.
template <std::uint32_t longest>
using EdgePeriod = control::EdgePeriodVelocity<float, longest>;

}  // namespace kmax::studies
