#include "control/motion_plausibility.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "control/foaw_velocity.hpp"

namespace kmax::control::motion_plausibility_test {

using Watch = MotionPlausibility<float>;

constexpr double tick = 5e-5;
constexpr double count = 55e-6;  // m, the coarse encoder
constexpr double pi = 3.14159265358979;

/// A handle in steps of 2.5 us: mass, Coulomb friction, elastic stops; the watch sees counts once a tick.
struct Handle {
  double mass = 0.05, friction = 0.0, stop = 1.0, stop_stiffness = 50e3;
  double returned = 1.0;  // share of the energy that a stop gives back
  double position = 0.0, velocity = 0.0;
  bool foaw = false;  // else the plain difference of counts

  MotionPlausibilityConfig<float> config;
  Watch watch;
  FoawVelocity<float> estimator;
  std::int64_t last_count = 0;

  void start() {
    last_count = counted();
    estimator.reset(last_count);
    c = Watch::prepare(config, static_cast<float>(tick));
    fit = FoawVelocity<float>::prepare(16, static_cast<float>(tick), static_cast<float>(count), 1);
    for (int n = 0; n < 2000; ++n) watch.follow(c, static_cast<float>(velocity));
  }
  std::int64_t counted() const { return static_cast<std::int64_t>(std::floor(position / count)); }

  /// One tick: `told` is the force the watch is told of, `acting` the one that acts, `hand` any other.
  bool step(double told, double acting, double hand, std::int64_t jitter = 0) {
    constexpr int parts = 20;
    for (int n = 0; n < parts; ++n) {
      const double h = tick / parts;
      double sum = acting + hand;
      const double beyond = std::fabs(position) - stop;
      const double share = position * velocity > 0.0 ? 1.0 : returned;
      if (beyond > 0.0) sum -= std::copysign(share * stop_stiffness * beyond, position);
      const double free = velocity + h * sum / mass;
      const double brake = h * friction / mass;
      velocity = std::fabs(free) <= brake ? 0.0 : free - std::copysign(brake, free);
      position += h * velocity;
    }
    const std::int64_t now = counted() + jitter;
    float seen = static_cast<float>(static_cast<double>(now - last_count) * count / tick);
    if (foaw) seen = estimator.update(fit, now, FoawFit::best);
    last_count = now;
    return watch.update(c, static_cast<float>(told), seen);
  }

  Watch::Coefficients c;
  FoawVelocity<float>::Coefficients fit;
};

double unit() {
  return *rc::gen::inRange(-1000, 1001) / 1000.0;
}

// Forces change at random ticks; the hand may do anything up to its allowance, also always push along the
// motion, which is the most it can give.
RC_GTEST_PROP(MotionPlausibility, NoAllowedHandTripsIt, ()) {
  Handle handle;
  handle.mass = *rc::gen::element(0.03, 0.05, 0.2);
  handle.config.mass = static_cast<float>(handle.mass);
  handle.config.hand_force = static_cast<float>(*rc::gen::element(0.5, 2.0, 5.0));
  handle.friction = *rc::gen::element(0.0, 0.1);
  handle.stop = *rc::gen::element(0.005, 0.05);
  handle.stop_stiffness = *rc::gen::element(3e3, 50e3, 500e3);
  handle.returned = 0.64;  // bounces 0.8 times as fast as it came: rubber
  handle.foaw = *rc::gen::arbitrary<bool>();
  handle.start();
  const double allowance = static_cast<double>(handle.config.hand_force);
  for (int stretch = 0; stretch < 40; ++stretch) {
    const double force = 3.3 * unit();
    const int behaviour = *rc::gen::inRange(0, 4);
    const double constant = allowance * unit(), aim = handle.stop * unit();
    const int ticks = *rc::gen::element(1, 7, 60, 400);
    for (int n = 0; n < ticks; ++n) {
      double hand = constant;
      if (behaviour == 1) hand = handle.velocity < 0.0 ? -allowance : allowance;
      if (behaviour == 2) hand = std::clamp(2000.0 * (aim - handle.position), -allowance, allowance);
      if (behaviour == 3) hand = 0.0;
      // 3 m/s is beyond what a hand follows; faster only a velocity limit is of use.
      const bool fast = std::fabs(handle.velocity) > 3.0;
      if (fast && hand * handle.velocity > 0.0) hand = 0.0;
      const double acting = fast && force * handle.velocity > 0.0 ? 0.0 : force;
      RC_ASSERT(!handle.step(acting, acting, hand));
    }
  }
}

// The hardest throw-back: a stop of steel without losses, the motor and the hand pushing into it.
TEST(MotionPlausibility, ImpactsOnAStopDoNotTrip) {
  for (const double stiffness : {1e3, 20e3, 1e6}) {
    for (const double hand : {0.0, 4.9}) {
      Handle handle;
      handle.config.hand_force = 5.0f;
      handle.stop = 0.01;
      handle.stop_stiffness = stiffness;
      handle.velocity = 2.0;
      handle.start();
      for (int n = 0; n < 40000; ++n) ASSERT_FALSE(handle.step(3.3, 3.3, hand)) << stiffness << ' ' << n;
    }
  }
}

// With no hand allowed at all the memory alone has to keep what the stop gives back.
TEST(MotionPlausibility, AnImpactDoesNotTripEvenWithoutAHand) {
  Handle handle;
  handle.config.hand_force = 0.0f;
  handle.stop = 0.01;
  handle.stop_stiffness = 20e3;
  handle.velocity = 1.0;
  handle.start();
  for (int n = 0; n < 4000; ++n) ASSERT_FALSE(handle.step(0.0, 0.0, 0.0)) << n;
}

// A wall far too stiff for its rate makes energy, but with the force that it says it makes.
TEST(MotionPlausibility, AnUnstableWallIsNoSpinOut) {
  Handle handle;
  handle.config.hand_force = 1.0f;
  handle.config.tolerance = 0.02f;
  handle.start();
  double force = 0.0;
  for (int n = 0; n < 40000; ++n) {
    if (n % 40 == 0) {
      const double inside = static_cast<double>(handle.counted()) * count;
      force = inside > 0.0 ? -std::fmin(20000.0 * inside, 20.0) : 0.0;
    }
    ASSERT_FALSE(handle.step(force, force, 0.9)) << n;
  }
}

TEST(MotionPlausibility, EncoderJitterIsNoMotion) {
  for (const bool foaw : {false, true}) {
    for (const double speed : {0.0, 0.003, 0.1, 1.0}) {
      Handle handle;
      handle.config.hand_force = 0.5f;
      handle.config.tolerance = 0.005f;
      handle.mass = 1e9;  // moves on whatever the force
      handle.velocity = speed;
      handle.foaw = foaw;
      handle.start();
      std::uint32_t random = 1;
      for (int n = 0; n < 40000; ++n) {
        random = random * 1664525u + 1013904223u;
        // The force, too, flutters at every tick: with the velocity at worst.
        const std::int64_t jitter = static_cast<std::int64_t>(random >> 30) % 3 - 1;
        ASSERT_FALSE(handle.step(jitter > 0 ? -0.4 : 0.4, 0.0, 0.0, jitter)) << speed << ' ' << n;
      }
    }
  }
}

struct Course {
  double ticks = -1.0;  // until it tripped, -1: never
  double travelled = 0.0;
};

/// The force acts as if turned by an electrical angle.
Course run_away(Handle& handle, double force, double angle, double hand, int ticks) {
  handle.start();
  const double from = handle.position;
  for (int n = 1; n <= ticks; ++n) {
    if (handle.step(force, force * std::cos(angle), hand))
      return {static_cast<double>(n), handle.position - from};
  }
  return {-1.0, handle.position - from};
}

TEST(MotionPlausibility, ARunAwayTripsInTheStatedDistance) {
  for (const double angle : {pi, 0.75 * pi, 2 * pi / 3}) {
    for (const double force : {-3.3, 3.3, -1.0}) {
      for (const double friction : {0.0, 0.1}) {
        for (const double speed : {0.0, 0.5}) {
          Handle handle;
          handle.friction = friction;
          handle.config.hand_force =
              static_cast<float>(0.7 * (std::fabs(force) * (1 - std::cos(angle)) - friction));
          handle.velocity = force < 0.0 ? speed : -speed;
          const double tolerance = static_cast<double>(handle.config.tolerance);
          const double unexplained = std::fabs(force) * (1 - std::cos(angle)) - friction -
                                     static_cast<double>(handle.config.hand_force);
          const Course run = run_away(handle, force, angle, 0.0, 40000);
          ASSERT_GT(run.ticks, 0.0) << angle << ' ' << force;
          const double kinetic = 0.5 * handle.mass * speed * speed;
          const double stated = (tolerance * 17 / 16 + 1.25 * kinetic) / unexplained;
          const double late = 3.0 * static_cast<double>(handle.config.smoothing);
          EXPECT_LE(std::fabs(run.travelled), stated + late * std::fabs(handle.velocity))
              << angle << ' ' << force;
          EXPECT_GE(std::fabs(run.travelled), 0.9 * tolerance / unexplained);
        }
      }
    }
  }
}

// A hand that has been led along by the force for long has left no credit behind.
TEST(MotionPlausibility, WhatWasLongAgoDoesNotHideARunAway) {
  Handle handle;
  handle.stop = 1e3;
  handle.velocity = 0.2;
  handle.start();
  for (int n = 0; n < 20000; ++n) ASSERT_FALSE(handle.step(3.3, 3.3, -3.3));
  const double from = handle.position;
  bool tripped = false;
  for (int n = 0; n < 2000 && !tripped; ++n) tripped = handle.step(-3.3, 3.3, 0.0);
  EXPECT_TRUE(tripped);
  const double kinetic = 0.5 * 0.05 * 0.2 * 0.2;
  EXPECT_LT(handle.position - from, (0.02 * 17 / 16 + 1.25 * kinetic) / 1.6 + 0.006 * handle.velocity);
}

TEST(MotionPlausibility, TheNumbersOfTheHeader) {
  Handle handle;
  handle.friction = 0.1;
  const Course run = run_away(handle, -3.3, pi, 0.0, 2000);
  EXPECT_GT(run.travelled, 0.012);
  EXPECT_LT(run.travelled, 0.022);
  EXPECT_LT(run.ticks * tick, 0.026);
}

// Just within what a hand may do, and just beyond: the same motion with the allowance changed.
TEST(MotionPlausibility, TheHandsAllowanceIsTheBound) {
  for (const double share : {0.95, 1.05}) {
    Handle handle;
    handle.stop = 1e3;
    handle.config.hand_force = static_cast<float>(2 * 3.3 * share);
    EXPECT_EQ(run_away(handle, -3.3, pi, 0.0, 10000).ticks > 0.0, share < 1.0);
    Handle pushed;
    pushed.stop = 1e3;
    pushed.config.hand_force = 4.0f;
    EXPECT_EQ(run_away(pushed, 1.0, 0.0, 4.0 / share, 10000).ticks > 0.0, share < 1.0);
  }
}

// And so for the tolerance: a short excess is forgiven.
TEST(MotionPlausibility, TheToleranceIsTheBound) {
  for (const double share : {0.8, 1.4}) {
    Handle handle;
    handle.config.hand_force = 4.0f;
    handle.start();
    bool tripped = false;
    // 2 N beyond the allowance over as many millimetres.
    for (int n = 0; n < 4000; ++n) {
      const bool beyond = handle.position < share * 0.02 / 2.0;
      tripped = handle.step(0.0, 0.0, beyond ? 6.0 : 0.0) || tripped;
    }
    EXPECT_EQ(tripped, share > 1.0) << share;
  }
}

// At 90 degrees no torque is made. A handle that rests says nothing; one that is moved against the force by
// less than it says a hand would need is found.
TEST(MotionPlausibility, AMissingForceIsFoundWhenTheHandleIsMovedAgainstIt) {
  for (const double allowance : {3.0, 3.6}) {
    Handle handle;
    handle.config.hand_force = static_cast<float>(allowance);
    handle.friction = 0.1;
    EXPECT_LT(run_away(handle, -3.3, pi / 2, 0.0, 2000).ticks, 0.0);  // rests
    handle.mass = 1e6;
    handle.velocity = 0.1;
    EXPECT_EQ(run_away(handle, -3.3, pi / 2, 0.0, 20000).ticks > 0.0, allowance < 3.3);
  }
}

TEST(MotionPlausibility, ANaNTripsAndStaysUntilReset) {
  const auto c = Watch::prepare({}, 5e-5f);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const bool of_force : {true, false}) {
    Watch watch;
    EXPECT_FALSE(watch.update(c, 1.0f, 0.0f));
    EXPECT_TRUE(watch.update(c, of_force ? nan : 1.0f, of_force ? 0.0f : nan));
    EXPECT_TRUE(watch.update(c, 1.0f, 0.0f));
    watch.reset();
    EXPECT_FALSE(watch.update(c, 1.0f, 0.0f));
  }
}

// Armed on the move: without follow() the motion itself would come out of nothing.
TEST(MotionPlausibility, AHandleArmedOnTheMoveDoesNotTrip) {
  MotionPlausibilityConfig<float> config;
  config.hand_force = 0.0f;
  const auto c = Watch::prepare(config, 5e-5f);
  Watch watch;
  for (int n = 0; n < 1000; ++n) watch.follow(c, 3.0f);
  for (int n = 0; n < 1000; ++n) ASSERT_FALSE(watch.update(c, 0.0f, 3.0f));
  Watch unprepared;
  bool tripped = false;
  for (int n = 0; n < 1000; ++n) tripped = unprepared.update(c, 0.0f, 3.0f) || tripped;
  EXPECT_TRUE(tripped);
  watch.follow(c, std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(watch.update(c, 0.0f, 0.0f));
}

// A count that jumps by 100 when an index is found moves nothing either.
TEST(MotionPlausibility, ResetForgets) {
  Handle handle;
  handle.start();
  EXPECT_TRUE(handle.step(0.0, 0.0, 0.0, 2000));
  handle.watch.reset();
  handle.last_count = handle.counted();
  for (int n = 0; n < 100; ++n) EXPECT_FALSE(handle.step(0.0, 0.0, 0.0));
}

}  // namespace kmax::control::motion_plausibility_test
