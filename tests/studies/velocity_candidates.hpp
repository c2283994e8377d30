#pragma once
// Velocity estimators that were tried against FOAW (docs/velocity_estimators.md): what each does, in float as
// in the image. Each takes the steps moved since the last sample and gives steps per sample. None is in the
// image.

#include <array>
#include <cstdint>

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

/// The time between edges. An edge is a sample in which the handle entered a step: between two of them the
/// steps moved and the samples passed are both whole numbers, so a slow motion has no noise. The line from
/// the newest edge back to the last one at least n samples ago is looked at for n = 1, 2, 4 .. `longest`, and
/// taken while it passes the edge of the line before it within one step, FOAW's band; the others are not
/// looked at. No line goes back beyond a turn. Between edges the velocity is at most one step in the time
/// since the last.
///
/// Valid: fewer than 2^17 steps in a window. A time is at most 4,096 samples, which bounds the products and
/// the error of a handle at rest.
template <std::uint32_t longest>
class EdgePeriod {
 public:
  float update(std::int32_t steps) {
    const std::uint32_t now = ++now_;
    Edge* const edges = &ring_[head_ = (head_ - 1) & (longest_ring - 1)];
    if (steps == 0) {
      std::uint32_t since = now - newest_.time;
      if (since > 4096) {
        newest_.time += since - 4096;
        since = 4096;
        turn_ = newest_;
      }
      edges[0] = edges[longest_ring] = newest_;
      const float most = inverse(since);
      if (velocity_ > most) velocity_ = most;
      if (velocity_ < -most) velocity_ = -most;
      return velocity_;
    }
    const std::uint32_t down = static_cast<std::uint32_t>(steps) >> 31;
    position_ += static_cast<std::uint32_t>(steps);
    // Entered from below at its lower border, from above at its upper one.
    const Edge newest{now, position_ + down};
    // After a turn of one step nobody knows how far it went. A larger one cannot be noise.
    if (down != down_) turn_ = static_cast<std::uint32_t>(steps + 1) <= 2 ? newest : newest_;
    down_ = down;
    edges[0] = edges[longest_ring] = newest_ = newest;
    const std::uint32_t since_turn = now - turn_.time;
    if (since_turn == 0) return velocity_ = 0.0F;
    Line line = newest - edges[1];
#pragma GCC unroll 4
    for (std::uint32_t back = 2; back <= longest; back *= 2) {
      const bool beyond = back > since_turn;
      const Line longer = newest - (beyond ? turn_ : edges[back]);
      const std::int32_t missed = line.steps * longer.samples - longer.steps * line.samples;
      if (missed > longer.samples || missed < -longer.samples) break;
      line = longer;
      if (beyond) break;
    }
    return velocity_ = static_cast<float>(line.steps) / static_cast<float>(line.samples);
  }

 private:
  static constexpr std::uint32_t longest_ring = 2 * longest;
  struct Line {
    std::int32_t samples, steps;
  };
  struct Edge {
    std::uint32_t time = 0, place = 0;  // samples, steps; modulo 2^32
    Line operator-(const Edge& older) const {
      return {static_cast<std::int32_t>(time - older.time), static_cast<std::int32_t>(place - older.place)};
    }
  };
  static float inverse(std::uint32_t samples) {
    return 1.0F / static_cast<float>(samples);
  }
  std::array<Edge, 2 * longest_ring> ring_{};  // each twice, so that the newest are contiguous
  Edge newest_{}, turn_{};
  std::uint32_t now_ = 0, head_ = 0, position_ = 0, down_ = 0;
  float velocity_ = 0.0F;
};

}  // namespace kmax::studies
