#include "control/stiffness_limits.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "control/sampled_stability.hpp"
#include "control/wall_law.hpp"
#include "tests/control/drawn_loop.hpp"

namespace kmax::control::stiffness_limits_test {

constexpr double largest = std::numeric_limits<double>::max();

// At most so many times the unit, whole.
double amount(double unit) {
  return unit * *rc::gen::inRange(1, 1000);
}

TEST(ColgateCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(colgate_stiffness_limit(1.0, 0.0, 1e-3, 0.0), 2000.0);
  EXPECT_DOUBLE_EQ(colgate_stiffness_limit(1.0, 0.25, 1e-3, 0.0), 1500.0);
  EXPECT_DOUBLE_EQ(colgate_stiffness_limit(1.0, -0.25, 1e-3, 0.0), 1500.0);
  EXPECT_DOUBLE_EQ(colgate_stiffness_limit(1.0, 0.0, 1e-3, 0.5e-3), 1000.0);
  EXPECT_DOUBLE_EQ(colgate_stiffness_limit(1.0, 2.0, 1e-3, 0.0), -2000.0);
  EXPECT_EQ(colgate_stiffness_limit(1.0, 0.0, 0.0, 0.0), largest);
  EXPECT_EQ(colgate_stiffness_limit(0.0, 0.0, 0.0, 0.0), 0.0);
  EXPECT_EQ(colgate_stiffness_limit(0.0, 0.0, 1e-3, 0.0), 0.0);
}

RC_GTEST_PROP(ColgateCriterion, MoreDampingAllowsMoreAndEverythingElseLess, ()) {
  const double b = amount(0.01), wall = b * *rc::gen::inRange(0, 100) / 100.0, period = amount(1e-5),
               delay = amount(1e-5), more = amount(1e-4);
  const double limit = colgate_stiffness_limit(b, wall, period, delay);
  RC_ASSERT(limit > 0.0);
  RC_ASSERT(colgate_stiffness_limit(b + more, wall, period, delay) > limit);
  RC_ASSERT(colgate_stiffness_limit(b, wall + more, period, delay) < limit);
  RC_ASSERT(colgate_stiffness_limit(b, -wall - more, period, delay) < limit);
  RC_ASSERT(colgate_stiffness_limit(b, wall, period + more, delay) < limit);
  RC_ASSERT(colgate_stiffness_limit(b, wall, period, delay + more) < limit);
  const auto f = [](double value) { return static_cast<float>(value); };
  const double single = static_cast<double>(colgate_stiffness_limit(f(b), f(wall), f(period), f(delay)));
  RC_ASSERT(std::abs(single - limit) <= 1e-6 * (b + wall) / (period / 2 + delay));
}

// The source's general condition, b > T/2 Re{(1 - e^-jwT) H}/(1 - cos wT) at every frequency up to Nyquist's,
// for H = (K + B (z - 1)/(T z)) z^-n: K and B at the limit meet it, 0.1 % more stiffness does not.
TEST(ColgateCriterion, IsTheGeneralConditionForSpringDamperAndWholeSamplesOfDelay) {
  LoopDraw draw(4);
  for (int i = 0; i < 300; ++i) {
    const double period = draw.log_uniform(5e-5, 4e-3), damping = draw.log_uniform(0.01, 10.0);
    const int late = static_cast<int>(draw.uniform(0.0, 5.0));
    // Positive B charges at high frequency what delay charges at low: with both the limit is only sufficient.
    const bool tight = i % 2 == 0;
    const double wall_damping = tight ? 0.0 : damping * draw.uniform(-0.9, 0.9);
    const double limit = colgate_stiffness_limit(damping, wall_damping, period, late * period);
    const auto needed = [&](double stiffness) {
      double most = 0.0;
      for (int step = 1; step <= 3000; ++step) {
        const double angle = 3.14159265358979 * step / 3000;
        const std::complex<double> back = std::polar(1.0, -angle);
        const auto wall = (stiffness + wall_damping / period * (1.0 - back)) * std::pow(back, late);
        most = std::max(most, period / 2 * std::real((1.0 - back) * wall) / (1.0 - std::cos(angle)));
      }
      return most;
    };
    EXPECT_LE(needed(limit), damping * (1 + 1e-9)) << i;
    if (tight) {
      EXPECT_GT(needed(1.001 * limit), damping) << i;
    }
  }
}

// What the criterion promises: whoever holds the device, as long as it is a passive hand, the loop is stable.
TEST(ColgateCriterion, EveryPassiveHandIsStableBelowTheLimit) {
  LoopDraw draw(5);
  int judged = 0;
  for (int i = 0; i < 20000; ++i) {
    SampledLoop<double> loop = draw.loop();
    loop.hand = {draw.log_uniform(1e-3, 10.0), draw.log_uniform(1.0, 1e6), draw.log_uniform(1e-3, 100.0),
                 draw.log_uniform(1.0, 1e5), draw.log_uniform(1e-3, 100.0)};
    const double limit = colgate_stiffness_limit(loop.damping, loop.wall_damping, loop.period, loop.delay);
    if (limit <= 0.0) continue;
    ++judged;
    const double stiffness = limit * draw.uniform(0.01, 0.999);
    EXPECT_TRUE(is_stable(loop, stiffness)) << i;
  }
  EXPECT_GT(judged, 10000);
}

// For a part of a sample the limit is not quite safe: the worst hand is heavy, soft and undamped.
TEST(ColgateCriterion, APartOfASampleOfDelayIsOffByAHundredthOfTheGain) {
  constexpr double mass = 0.05, period = 1e-3;
  for (const double gain : {0.03, 0.1, 0.3, 1.0}) {
    double worst = 1.0;
    for (double part = 0.05; part < 1.0; part += 0.05) {
      const double delay = part * period, stiffness = gain * mass / (period * period);
      const double damping = stiffness * (0.5 * period + delay);
      ASSERT_NEAR(colgate_stiffness_limit(damping, 0.0, period, delay), stiffness, 1e-9 * stiffness);
      const SampledLoop<double> loop{mass, damping, 0.0, period, delay, {1.0, 10.0, 0.0, 0.0, 0.0}};
      const double share = largest_stable_stiffness(loop) / stiffness;
      EXPECT_GT(share, 1.0 - 0.0085 * gain / (0.5 + part)) << gain << ' ' << part;
      worst = std::min(worst, share);
    }
    EXPECT_NEAR(worst, 1.0 - 0.0113 * gain, 0.001 * gain) << gain;
  }
}

TEST(GilCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, 0.0, 1e-3, 0.0), 2000.0);
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, 0.5, 1e-3, 0.25e-3), 2000.0);
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, -2.0, 1e-3, 0.0), -2000.0);
  EXPECT_EQ(gil_stiffness_limit(1.0, 0.0, 0.0, 0.0), std::numeric_limits<double>::max());
  EXPECT_EQ(gil_stiffness_limit(0.0, 0.0, 0.0, 0.0), 0.0);
  EXPECT_EQ(gil_stiffness_limit(1e308, 1e308, 4.0, 0.0), std::numeric_limits<double>::max() / 2.0);
}

RC_GTEST_PROP(GilCriterion, WallDampingHelpsAndWithoutItTheLimitIsColgates, ()) {
  const double b = amount(0.01), period = amount(1e-5), delay = amount(1e-5), more = amount(1e-4);
  const double limit = gil_stiffness_limit(b, 0.0, period, delay);
  RC_ASSERT(limit == colgate_stiffness_limit(b, 0.0, period, delay));
  RC_ASSERT(gil_stiffness_limit(b, more, period, delay) > limit);
  RC_ASSERT(gil_stiffness_limit(b, -more, period, delay) < limit);
  RC_ASSERT(gil_stiffness_limit(b, 0.0, period, delay + more) < limit);
  RC_ASSERT(gil_stiffness_limit(b, 0.0, period + more, delay) < limit);
}

// It is the exact limit's first order: the difference goes with (b + |B|)(T + Td)/m.
TEST(GilCriterion, IsTheExactLimitForFastSampling) {
  LoopDraw draw(6);
  for (const double speed : {1e-2, 1e-3, 1e-4}) {
    double worst = 0.0;
    for (int i = 0; i < 200; ++i) {
      SampledLoop<double> loop{draw.log_uniform(0.01, 1.0), draw.log_uniform(0.01, 10.0), 0.0, 0.0, 0.0, {}};
      loop.wall_damping = loop.damping * draw.uniform(-0.5, 2.0);
      const double late = i % 2 == 0 ? 0.0 : draw.uniform(0.0, 5.0);
      loop.period = speed * loop.mass / ((loop.damping + std::abs(loop.wall_damping)) * (1.0 + late));
      loop.delay = late * loop.period;
      const double exact = largest_stable_stiffness(loop);
      const double linear = gil_stiffness_limit(loop.damping, loop.wall_damping, loop.period, loop.delay);
      worst = std::max(worst, std::abs(exact / linear - 1.0));
    }
    EXPECT_LT(worst, 4.0 * speed);
    EXPECT_GT(worst, 0.01 * speed);
  }
}

// The numbers that the header gives for where it does not hold.
TEST(GilCriterion, ErrsWithHighDamping) {
  const SampledLoop<double> loop{0.045, 8.41, 0.0, 2e-3, 0.0, {}};
  EXPECT_NEAR(largest_stable_stiffness(loop) / gil_stiffness_limit(8.41, 0.0, 2e-3, 0.0), 1.066, 1e-3);
  const SampledLoop<double> damped{0.045, 0.5, 20.0, 2e-3, 0.0, {}};
  EXPECT_LT(largest_stable_stiffness(damped), 0.7 * gil_stiffness_limit(0.5, 20.0, 2e-3, 0.0));
  const SampledLoop<double> overdone{0.045, 0.5, 60.0, 2e-3, 0.0, {}};
  EXPECT_EQ(largest_stable_stiffness(overdone), 0.0);
}

TEST(AbbottOkamuraCriterion, TheSmallerPartLimits) {
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 1.0, 1e-3, 1e-4), 2000.0);
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 0.01, 1e-3, 1e-4), 200.0);
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.093, 2e-3, 55e-6), 3381.8, 0.1);
}

TEST(AbbottOkamuraCriterion, WhatIsNotThereDoesNotLimit) {
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 0.0, 1e-3, 0.0), 2000.0);
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, 0.0, 1e-3), 2000.0);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 0.0, 0.0, 0.0), largest);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, 1e-3, 1e-6), 0.0);
  EXPECT_EQ(abbott_okamura_stiffness_limit(1.0, 0.0, 1e-3, 1e-6), 0.0);
  constexpr double tiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(abbott_okamura_stiffness_limit(1.0, 1.0, tiny, tiny), largest);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, tiny, tiny), 0.0);
}

// 2 (f_c/Delta - |B|/T): 2 (0.1/50e-6 - 1/1e-3) = 2000.
TEST(AbbottOkamuraCriterion, ADamperTakesItsStepOfTheFriction) {
  for (const double wall_damping : {1.0, -1.0}) {
    EXPECT_NEAR(position_step_stiffness_limit(0.1, wall_damping, 1e-3, 50e-6), 2000.0, 1e-9);
    EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 50e-6, wall_damping), 2000.0, 1e-9);
  }
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 50e-6, 3.0), -2000.0, 1e-9);
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 0.0, 3.0), 20000.0, 1e-9) << "no step";
  EXPECT_EQ(position_step_stiffness_limit(0.1, 1.0, 0.0, 50e-6), -largest) << "no period";
}

// Over every pair of positions that lie on the border of two steps: the force that is computed is never
// farther from that of the true positions than the friction at the limit.
TEST(AbbottOkamuraCriterion, FrictionAtTheLimitIsTheWorstErrorOfTheForce) {
  const double friction = 0.2, period = 1e-3, quantum = 50e-6;
  for (const double wall_damping : {0.0, 0.5, 2.0, -2.0}) {
    const double stiffness = position_step_stiffness_limit(friction, wall_damping, period, quantum);
    ASSERT_GT(stiffness, 0.0);
    double worst = 0.0;
    for (int now = -60; now <= 60; ++now) {
      for (int before = -60; before <= 60; ++before) {
        const auto error = [&](int at) {
          const double position = (at / 20.0 + 1e-12) * quantum;
          return std::floor(position / quantum + 0.5) * quantum - position;
        };
        worst = std::max(
            worst, std::abs(stiffness * error(now) + wall_damping * (error(now) - error(before)) / period));
      }
    }
    EXPECT_LE(worst, friction * 1.0000001);
    if (wall_damping >= 0.0) {
      EXPECT_GT(worst, 0.9 * friction);
    }
  }
}

RC_GTEST_PROP(AbbottOkamuraCriterion, Monotone, ()) {
  const double b = amount(0.01), friction = amount(0.001), period = amount(1e-5), quantum = amount(1e-6);
  const double limit = abbott_okamura_stiffness_limit(b, friction, period, quantum);
  RC_ASSERT(limit <= 2 * b / period * (1 + 1e-15));
  RC_ASSERT(limit * quantum <= 2 * friction * (1 + 1e-15));
  RC_ASSERT(abbott_okamura_stiffness_limit(2 * b, 2 * friction, period, quantum) == 2 * limit);
  RC_ASSERT(abbott_okamura_stiffness_limit(b, friction, 2 * period, 2 * quantum) == limit / 2);
  RC_ASSERT(abbott_okamura_stiffness_limit(2 * b, friction, period, quantum) >= limit);
  RC_ASSERT(abbott_okamura_stiffness_limit(b, 2 * friction, period, quantum) >= limit);
}

TEST(FieldCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 1e-3), 4000.0);
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 10e-6), 400000.0);
  EXPECT_EQ(steepest_field_slope(0.0, 1e-3), 0.0);
  EXPECT_EQ(steepest_field_slope(0.0, 0.0), 0.0);
  EXPECT_EQ(steepest_field_slope(1.0, 0.0), std::numeric_limits<double>::max());
}

TEST(FieldCriterion, TheLimitIsTheSmallerOfHoldAndStep) {
  // (20 - 0)/0.5 ms = 40000 and 2 * 0.01/0.055 mm = 364: 2 N over 0.2 mm pass the first and buzz.
  EXPECT_DOUBLE_EQ(field_slope_limit(20.0, 0.0, 0.01, 1e-3, 0.0, 0.0), 40000.0);
  EXPECT_NEAR(field_slope_limit(20.0, 0.0, 0.01, 1e-3, 0.0, 55e-6), 363.6, 0.1);
  EXPECT_DOUBLE_EQ(field_slope_limit(20.0, 0.0, 10.0, 1e-3, 0.0, 55e-6), 40000.0);
  EXPECT_NEAR(field_slope_limit(20.0, 1.0, 0.1, 1e-3, 0.5e-3, 50e-6), 2000.0, 1e-6);
  EXPECT_NEAR(field_slope_limit(2.0, 1.0, 1.0, 1e-3, 0.5e-3, 50e-6), 1000.0, 1e-6);
}

// No field within its limit changes by more than twice the friction over one step, wherever the steps lie.
RC_GTEST_PROP(FieldCriterion, FrictionHoldsEveryStepWithinTheLimit, ()) {
  const double friction = *rc::gen::inRange(1, 100) * 0.01, quantum = *rc::gen::inRange(1, 100) * 1e-6;
  const double length = *rc::gen::inRange(1, 100) * 1e-5;
  const double limit = field_slope_limit(1e6, 0.0, friction, 1e-3, 0.0, quantum);
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare({.kind = WallKind::magnetic,
                                                  .magnetic_coefficient = limit * length / 2,
                                                  .magnetic_length = length,
                                                  .adaptive = {}},
                                                 1e-3);
  for (int i = 0; i < 40; ++i) {
    const double from = i * 0.25 * quantum;
    const double step =
        law.update(prepared, from, 0.0).force - law.update(prepared, from + quantum, 0.0).force;
    RC_ASSERT(step <= 2 * friction * (1 + 1e-12));
  }
}

// The slope is that of the law that runs: reached at the surface, and nowhere exceeded.
RC_GTEST_PROP(FieldCriterion, IsTheLawsSteepestSlope, ()) {
  WallLawConfig<double> config;
  config.kind = WallKind::magnetic;
  config.magnetic_coefficient = *rc::gen::inRange(1, 100) * 0.1;
  config.magnetic_length = *rc::gen::inRange(1, 100) * 1e-4;
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare(config, 1e-3);
  const auto slope_at = [&](double distance) {
    const double step = 1e-6 * config.magnetic_length;
    return (law.update(prepared, distance, 0.0).force - law.update(prepared, distance + step, 0.0).force) /
           step;
  };
  const double steepest = steepest_field_slope(config.magnetic_coefficient, config.magnetic_length);
  const double near = slope_at(1e-6 * config.magnetic_length);
  RC_ASSERT(near <= steepest && near > 0.9999 * steepest);
  for (int i = 1; i < 50; ++i) RC_ASSERT(slope_at(i * 0.1 * config.magnetic_length) < steepest);
  RC_ASSERT(std::abs(slope_at(config.magnetic_length) / steepest - 0.125) < 1e-4);  // as the header says
}

}  // namespace kmax::control::stiffness_limits_test
