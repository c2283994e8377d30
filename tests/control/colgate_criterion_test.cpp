#include "control/colgate_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <complex>
#include <limits>

#include "control/sampled_stability.hpp"
#include "tests/control/drawn_loop.hpp"

namespace kmax::control::colgate_criterion_test {
namespace {

constexpr double largest = std::numeric_limits<double>::max();

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
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
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
    EXPECT_TRUE(is_stable(loop, stiffness)) << i << ": radius " << spectral_radius(loop, stiffness);
  }
  EXPECT_GT(judged, 10000);
}

}  // namespace
}  // namespace kmax::control::colgate_criterion_test
