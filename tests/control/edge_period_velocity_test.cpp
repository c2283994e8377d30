#include "control/edge_period_velocity.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include "tests/in_a_soak.hpp"

namespace kmax::control::edge_period_velocity_test {

using Estimator = EdgePeriodVelocity<double>;

// The definition, written down literally over all that was ever seen.
class Definition {
 public:
  double update(std::int64_t steps) {
    const auto now = static_cast<std::int64_t>(as_of_.size());
    if (steps == 0) {
      Edge last = as_of_.back();
      if (now - last.time > 4096) {
        last.time = now - 4096;
        origin_ = last;
        direction_ = 0;
        velocity_ = 0.0;
      }
      as_of_.push_back(last);
      const double most = 1.0 / static_cast<double>(now - last.time);
      return velocity_ = std::clamp(velocity_, -most, most);
    }
    position_ += steps;
    const bool down = steps < 0;
    const int direction = down ? -1 : 1;
    const Edge newest{now, position_ + (down ? 1 : 0)};
    if (direction != direction_) origin_ = std::abs(steps) == 1 || direction_ == 0 ? newest : as_of_.back();
    direction_ = direction;
    as_of_.push_back(newest);
    if (std::abs(steps) > 16'384) origin_ = newest;
    if (origin_.time == now) return velocity_ = static_cast<double>(steps - direction);
    std::vector<Edge> looked_at;
    for (std::int64_t back = 1; back <= 16; back *= 2) {
      const bool beyond = back > now - origin_.time;
      looked_at.push_back(beyond ? origin_ : as_of_[static_cast<std::size_t>(now - back)]);
      if (beyond) break;
    }
    Edge oldest = looked_at.front();
    for (std::size_t i = 1; i < looked_at.size(); ++i) {
      const double slope = slope_between(looked_at[i], newest);
      const double passes =
          static_cast<double>(newest.place) - slope * static_cast<double>(newest.time - oldest.time);
      // The smallest distance of two different ones is above 1 / 4112.
      if (std::abs(passes - static_cast<double>(oldest.place)) > 1.0 + 1e-6) break;
      oldest = looked_at[i];
    }
    velocity_ = slope_between(oldest, newest);
    const auto least = static_cast<double>(steps - direction);
    if (std::abs(velocity_) < std::abs(least)) velocity_ = least;
    return velocity_;
  }

 private:
  struct Edge {
    std::int64_t time, place;
  };
  static double slope_between(const Edge& older, const Edge& newer) {
    return static_cast<double>(newer.place - older.place) / static_cast<double>(newer.time - older.time);
  }
  std::vector<Edge> as_of_ = std::vector<Edge>(17, {16 - 4096, 0});  // 17 samples of rest
  Edge origin_ = as_of_.front();
  std::int64_t position_ = 0;
  double velocity_ = 0.0;
  int direction_ = 0;  // of the last edge; 0: none since a rest
};

// Steps of a legged motion: rests, slow and fast ramps, bends, noise, jumps of every size.
std::vector<std::int32_t> any_motion() {
  std::vector<std::int32_t> all;
  const int legs = *rc::gen::inRange(1, 12);
  for (int leg = 0; leg < legs; ++leg) {
    double speed = *rc::gen::inRange(-2'000, 2'001) * 1e-3;
    const double bend = *rc::gen::element(0.0, 0.0, 1e-4, -1e-2, 0.3);
    speed *= *rc::gen::element(0.0, 0.01, 0.1, 1.0, 10.0, 1000.0);
    const int noise = *rc::gen::element(0, 0, 0, 1, 3);
    const int length = *rc::gen::element(3, 40, 200, 200, 5000);
    double position = 0.5;
    std::int64_t last = 0;
    for (int k = 0; k < length; ++k) {
      speed += bend;
      position += speed;
      // Random numbers are costly: short legs only.
      const int shaken = noise != 0 && length <= 200 ? *rc::gen::inRange(-noise, noise + 1) : 0;
      const auto place = static_cast<std::int64_t>(std::floor(position)) + shaken;
      all.push_back(static_cast<std::int32_t>(place - last));
      last = place;
    }
    if (*rc::gen::inRange(0, 3) == 0)
      all.push_back(*rc::gen::element(2, -2, 17, -1000, 16'384, -16'384, 16'385, -16'385, 1 << 30,
                                      std::numeric_limits<std::int32_t>::min(),
                                      std::numeric_limits<std::int32_t>::max()));
  }
  return all;
}

RC_GTEST_PROP(EdgePeriodVelocity, IsItsDefinitionToTheBit, ()) {
  Estimator estimator;
  EdgePeriodVelocity<float> narrow;
  Definition definition;
  for (const std::int32_t steps : any_motion()) {
    const double expected = definition.update(steps);
    RC_ASSERT(estimator.update(steps) == expected);
    const auto in_float = static_cast<double>(narrow.update(steps));
    RC_ASSERT(std::abs(in_float - expected) <= 6e-8 * std::abs(expected));
  }
}

RC_GTEST_PROP(EdgePeriodVelocity, TheOtherWayIsTheMirrorImageToTheBit, ()) {
  EdgePeriodVelocity<float> one, other;
  for (const std::int32_t steps : any_motion()) {
    const std::int32_t within = std::max(steps, -std::numeric_limits<std::int32_t>::max());
    RC_ASSERT(one.update(within) == -other.update(-within));
  }
}

// What a line between two edges can be off by: each lies up to a sample, and up to a step, behind the place
// where the handle entered.
double line_error(double speed) {
  const double size = std::abs(speed);
  return std::min(size, 1.0) / std::max(16.0, 1.0 / size - 1.0) + 1e-9;
}

TEST(EdgePeriodVelocity, AConstantVelocityIsFoundOverSevenDecades) {
  for (double size = 3e-4; size < 5e3; size *= 1.37) {
    for (const double speed : {size, -size}) {
      Estimator estimator;
      const auto settled = static_cast<int>(4.0 / size) + 40;
      std::int64_t last = 0;
      for (int k = 1; k < 2 * settled + 100; ++k) {
        const auto place = static_cast<std::int64_t>(std::floor(0.3 + speed * k));
        const double estimate = estimator.update(static_cast<std::int32_t>(place - last));
        last = place;
        if (k <= settled) continue;
        ASSERT_NEAR(estimate, speed, line_error(speed)) << "sample " << k;
      }
    }
  }
}

TEST(EdgePeriodVelocity, AReversalIsSeenAtItsFirstEdgeAndMeasuredAtTheThird) {
  for (const double size : {0.003, 0.05, 0.4, 1.0, 3.7, 250.0}) {
    for (const double speed : {size, -size}) {
      Estimator estimator;
      std::int64_t last = 0;
      int edges = 0;
      const auto turn = static_cast<int>(10.0 / size) + 60;
      for (int k = 1; k < 2 * turn; ++k) {
        const auto place = static_cast<std::int64_t>(std::floor(0.5 + speed * (k < turn ? k : 2 * turn - k)));
        const auto steps = static_cast<std::int32_t>(place - last);
        const double back = -estimator.update(steps) / speed;  // 1: fully turned
        last = place;
        if (k <= turn) continue;
        edges += steps != 0 ? 1 : 0;
        if (edges > 0) {
          ASSERT_GE(back, 0.0) << speed << ", sample " << k;
        }
        if (edges > 2) {
          ASSERT_NEAR(back, 1.0, 0.5) << speed << ", sample " << k;
        }
        if (edges > 40) {
          ASSERT_NEAR(back, 1.0, line_error(speed) / size) << speed << ", sample " << k;
        }
      }
    }
  }
}

// Whatever came before, and however long it stays on either side.
RC_GTEST_PROP(EdgePeriodVelocity, ADitherOfOneCountHasNoVelocity, ()) {
  Estimator estimator;
  for (const std::int32_t steps : any_motion()) estimator.update(steps);
  std::int32_t step = *rc::gen::element(1, -1);
  for (int toggles = 0; toggles < 60; ++toggles, step = -step) {
    const double estimate = estimator.update(step);
    if (toggles == 0) continue;
    RC_ASSERT(estimate == 0.0);
    for (int wait = *rc::gen::inRange(0, 30); wait > 0; --wait) RC_ASSERT(estimator.update(0) == 0.0);
  }
}

RC_GTEST_PROP(EdgePeriodVelocity, AtRestTheVelocityFallsAndEnds, ()) {
  Estimator estimator;
  for (const std::int32_t steps : any_motion()) estimator.update(steps);
  double last = std::abs(estimator.update(*rc::gen::element(1, -1, 3, -700)));
  for (int rested = 1; rested <= 4200; ++rested) {
    const double speed = std::abs(estimator.update(0));
    RC_ASSERT(speed <= last);
    RC_ASSERT(speed <= 1.0 / rested);
    if (rested > 4096) RC_ASSERT(speed == 0.0);
    last = speed;
  }
}

TEST(EdgePeriodVelocity, AStartAtAVelocityGivesItFromTheFirstSampleOn) {
  // Whole numbers exactly, for as long as they last.
  for (const int speed : {1, -1, 2, -3, 17, -400, 16'384, -16'384}) {
    Estimator estimator(speed);
    for (int k = 0; k < 100; ++k) ASSERT_EQ(estimator.update(speed), speed) << k;
  }
  // Others as well as a line over the window can be.
  for (double size = 1e-3; size < 1.6e4; size *= 1.21) {
    for (const double speed : {size, -size}) {
      Estimator estimator(speed);
      std::int64_t last = 0;
      for (int k = 1; k < 3000; ++k) {
        const double distance = std::floor(0.5 + size * k);
        const auto place = static_cast<std::int64_t>(speed < 0 ? -distance : distance);
        const double estimate = estimator.update(static_cast<std::int32_t>(place - last));
        last = place;
        if (k == 1 && size < 0.5) {
          ASSERT_EQ(estimate, speed);
        } else {
          ASSERT_NEAR(estimate, speed, line_error(speed)) << "sample " << k;
        }
      }
    }
  }
}

// Where in its step the handle is, a start does not know: a slow one is then off by no more than half to
// twice, a fast one by no more than the difference of two samples is.
RC_GTEST_PROP(EdgePeriodVelocity, AStartBetweenTwoStepsMakesNoSpike, ()) {
  const double size = std::pow(10.0, *rc::gen::inRange(-3'300, 3'000) * 1e-3);
  const double speed = *rc::gen::element(1.0, -1.0) * size;
  const double phase = *rc::gen::inRange(0, 1'000) * 1e-3;
  Estimator estimator(speed);
  std::int64_t last = 0;
  for (int k = 1; k < 6000; ++k) {
    const auto place = static_cast<std::int64_t>(std::floor(phase + speed * k));
    const double estimate = estimator.update(static_cast<std::int32_t>(place - last));
    last = place;
    RC_ASSERT(estimate * speed > 0.0);
    RC_ASSERT(std::abs(estimate - speed) <= std::min(1.0, 1.1 * size));
    if (size <= 1.0 / 16.0) RC_ASSERT(std::abs(estimate) >= 0.5 * size);
  }
}

TEST(EdgePeriodVelocity, AStartFasterThanCanBeIsCut) {
  constexpr double most = 16'384.0;
  for (const double velocity :
       {1.7e4, 1e300, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    for (const double side : {1.0, -1.0}) {
      Estimator estimator(side * velocity), most_there_is(std::isnan(velocity) ? most : side * most);
      for (const std::int32_t steps : {16'384, 5, 3, 0, 0, -1, -1})
        ASSERT_EQ(estimator.update(steps), most_there_is.update(steps)) << velocity;
    }
  }
  // Slower than a step in twice the longest time is at rest.
  for (const double velocity : {1.0 / 8'200.0, 5e-324, -5e-324, 0.0}) {
    Estimator estimator(velocity);
    EXPECT_EQ(estimator.update(0), 0.0) << velocity;
  }
}

TEST(EdgePeriodVelocity, AJumpIsNotSpreadOverTheRestBeforeIt) {
  for (const std::int32_t jump : {2, 5, 100, 16'384, 16'385, 1'000'000'000}) {
    for (const std::int32_t steps : {jump, -jump}) {
      for (const int rest : {1, 10, 5'000}) {
        Estimator estimator;
        estimator.update(1);
        for (int k = 0; k < rest; ++k) estimator.update(0);
        const double size = std::abs(estimator.update(steps));
        EXPECT_GE(size, jump - 1);
        EXPECT_LE(size, jump);
        EXPECT_LE(std::abs(estimator.update(0)), 1.0) << "and is over at once";
        // What follows is as after no jump.
        for (int k = 0; k < 40; ++k) estimator.update(steps > 0 ? 3 : -3);
        EXPECT_EQ(std::abs(estimator.update(steps > 0 ? 3 : -3)), 3.0);
      }
    }
  }
}

// A motion that never turns leaves its origin behind, until the origin looks like a time to come.
TEST(EdgePeriodVelocity, GoesOnWhenTheTimeOfItsOriginComesRound) {
  if (!in_a_soak()) GTEST_SKIP() << "takes a minute: set KMAX_SOAK=1";
  Estimator estimator, younger;
  constexpr std::uint32_t round = 1U << 31;
  std::uint32_t random = 1, until_edge = 0;
  for (std::uint32_t n = 1; n < round + 10'000; ++n) {
    const bool edge = until_edge == 0;
    if (edge) random = random * 1'664'525U + 1'013'904'223U;
    until_edge = edge ? 2 + (random >> 29) : until_edge - 1;
    const double velocity = estimator.update(edge ? 1 : 0);
    if (n < round - 10'000) continue;
    const double same = younger.update(edge ? 1 : 0);
    if (n > round - 9'000) {
      ASSERT_EQ(velocity, same) << n;
    }
  }
}

}  // namespace kmax::control::edge_period_velocity_test
