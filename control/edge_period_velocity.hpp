#pragma once

#include <array>
#include <cstdint>

#include "control/finite.hpp"

namespace kmax::control {

/// Velocity from the time between edges. An edge is a sample in which the handle entered a step; between two
/// of them the steps moved and the samples passed are both whole numbers, so a slow and steady motion has no
/// noise. docs/velocity_estimators.md compares it with others.
///
/// At an edge, the line from it back to the newest edge that is at least n samples old is looked at for
/// n = 1, 2, 4 .. `longest`, and taken while it passes the edge of the line before it within one step, the
/// band of FOAW; the others are not looked at. The slope of the last one is the velocity, but no less than
/// what the last sample shows by itself: the handle moved more than all but one of its steps in it. Between
/// edges the velocity is at most one step in the time since the last one.
///
///   standstill  the velocity falls as one over the time, and is 0 after 4096 samples without an edge. The
///               first edge after that is measured by its sample alone, which for one step gives 0
///   turn        no line goes back beyond it. One of a single step gives 0, so a count that dithers by one
///               has no velocity
///   jump        is in the velocity of its sample, less one step; behind one of more than 2^14 steps no line
///               goes back
///
/// Takes the steps moved since the last sample, any number of them, and gives steps per sample, always
/// finite. What is chosen is chosen in whole numbers, and the slope is one division of two of them below
/// 2^19: float on x86 and on ARM gives the same bits, and double takes the same lines. Time may wrap.
///
/// `longest`: samples, a power of two up to 16.
///
/// Cost on a Cortex-M4F (GCC 12.2, -O2; executed instructions): at most 125, on average 57 over the motions
/// of tests/benchmarks/instruction_budget, one of them a division; a start at a velocity about 600, once. 548
/// bytes.
template <typename Scalar, std::uint32_t longest = 16>
class EdgePeriodVelocity {
  static_assert(longest >= 1 && longest <= 16 && (longest & (longest - 1)) == 0);

 public:
  /// As if the handle had always stood still.
  EdgePeriodVelocity() : EdgePeriodVelocity(Scalar(0)) {}

  /// As if it had come here at this velocity, in steps per sample, and were in the middle of a step. More
  /// than 2^14, or what is not a number, is taken as 2^14; less than a step in 8192 samples is a rest.
  explicit EdgePeriodVelocity(Scalar velocity) {
    const bool falls = velocity < Scalar(0);
    Scalar speed = magnitude(velocity);
    if (!(speed < Scalar(most_steps))) speed = Scalar(most_steps);
    const Scalar period = speed > Scalar(0) ? Scalar(1) / speed : Scalar(2 * longest_time);
    for (std::uint32_t i = 0; i <= longest; ++i) {
      const auto back = static_cast<std::uint32_t>(speed * static_cast<Scalar>(i) + Scalar(0.5));
      const Scalar entered = (static_cast<Scalar>(back) + Scalar(0.5)) * period;
      std::uint32_t ago = longest_time;
      if (entered < Scalar(longest_time)) ago = static_cast<std::uint32_t>(entered);
      if (ago < i) ago = i;
      ring_[i] = ring_[i + ring] = {0U - ago, falls ? 1U + back : 0U - back};
    }
    newest_ = ring_[0];
    origin_ = ring_[longest];
    down_ = speed > Scalar(0) ? (falls ? 1U : 0U) : neither;
    velocity_ = falls ? -speed : speed;
  }

  Scalar update(std::int32_t steps) {
    const std::uint32_t now = ++now_;
    Edge* const edges = &ring_[head_ = (head_ - 1) & (ring - 1)];
    if (steps == 0) {
      const std::uint32_t since = now - newest_.time;
      if (since > longest_time) [[unlikely]] {
        newest_.time = now - longest_time;
        origin_ = newest_;  // or its time would come round
        down_ = neither;
        velocity_ = Scalar(0);
      }
      edges[0] = edges[ring] = newest_;
      const Scalar most = Scalar(1) / static_cast<Scalar>(static_cast<std::int32_t>(since));
      if (velocity_ > most) velocity_ = most;
      if (velocity_ < -most) velocity_ = -most;
      return velocity_;
    }
    const std::uint32_t down = static_cast<std::uint32_t>(steps) >> 31;
    const bool single = static_cast<std::uint32_t>(steps) + 1 <= 2;
    position_ += static_cast<std::uint32_t>(steps);
    // Entered from below at its lower border, from above at its upper one.
    const Edge newest{now, position_ + down};
    // After a turn of one step nobody knows how far it went. A larger one cannot be noise.
    if (down != down_) origin_ = single || down_ == neither ? newest : newest_;
    if (static_cast<std::uint32_t>(steps) + most_steps > 2 * most_steps) [[unlikely]]
      origin_ = newest;
    down_ = down;
    edges[0] = edges[ring] = newest_ = newest;
    auto since_origin = static_cast<std::int32_t>(now - origin_.time);
    if (since_origin <= 0) [[unlikely]] {
      if (since_origin == 0) return velocity_ = static_cast<Scalar>(less_one(steps));
      // So long ago that its time will soon look like one to come.
      origin_ = edges[longest];
      since_origin = longest;
    }
    Line line = newest - edges[1];
#pragma GCC unroll 4
    for (std::int32_t back = 2; back <= static_cast<std::int32_t>(longest); back *= 2) {
      const bool beyond = back > since_origin;
      const Line longer = newest - (beyond ? origin_ : edges[back]);
      // At most 16 samples' steps and 4112 samples: both products are below 2^31, and of the same sign.
      const std::int32_t missed = line.steps * longer.samples - longer.steps * line.samples;
      const auto band = static_cast<std::uint32_t>(longer.samples);
      if (static_cast<std::uint32_t>(missed) + band > 2 * band) break;
      line = longer;
      if (beyond) break;
    }
    if (!single) {
      const std::int32_t least = less_one(steps);
      const std::int32_t so_far = least * line.samples;
      if (down != 0 ? line.steps > so_far : line.steps < so_far)
        return velocity_ = static_cast<Scalar>(least);
    }
    return velocity_ = static_cast<Scalar>(line.steps) / static_cast<Scalar>(line.samples);
  }

 private:
  static constexpr std::uint32_t ring = 2 * longest;   // of which `longest` + 1 are needed
  static constexpr std::uint32_t longest_time = 4096;  // samples
  static constexpr std::uint32_t most_steps = 1U << 14;
  static constexpr std::uint32_t neither = 2;  // since a rest

  /// What a sample shows by itself.
  static std::int32_t less_one(std::int32_t steps) {
    return steps < 0 ? steps + 1 : steps - 1;
  }

  struct Line {
    std::int32_t samples, steps;
  };
  /// When the handle entered a step, and at which border; samples and steps modulo 2^32.
  struct Edge {
    std::uint32_t time, place;
    Line operator-(const Edge& older) const {
      return {static_cast<std::int32_t>(time - older.time), static_cast<std::int32_t>(place - older.place)};
    }
  };

  Edge newest_;
  Edge origin_;  // no line goes back beyond it
  std::uint32_t now_ = 0, head_ = 0, position_ = 0;
  std::uint32_t down_;  // 1: the last edge was entered from above, 0: from below
  Scalar velocity_;
  // The newest edge as of each of the last samples, newest first; each twice, so that they are contiguous.
  std::array<Edge, 2 * ring> ring_;
};

}  // namespace kmax::control
