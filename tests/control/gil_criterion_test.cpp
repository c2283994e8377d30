#include "control/gil_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "control/colgate_criterion.hpp"
#include "control/sampled_stability.hpp"
#include "tests/control/drawn_loop.hpp"

namespace kmax::control::gil_criterion_test {
namespace {

TEST(GilCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, 0.0, 1e-3, 0.0), 2000.0);
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, 0.5, 1e-3, 0.25e-3), 2000.0);
  EXPECT_DOUBLE_EQ(gil_stiffness_limit(1.0, -2.0, 1e-3, 0.0), -2000.0);
  EXPECT_EQ(gil_stiffness_limit(1.0, 0.0, 0.0, 0.0), std::numeric_limits<double>::max());
  EXPECT_EQ(gil_stiffness_limit(0.0, 0.0, 0.0, 0.0), 0.0);
  EXPECT_EQ(gil_stiffness_limit(1e308, 1e308, 4.0, 0.0), std::numeric_limits<double>::max() / 2.0);
}

RC_GTEST_PROP(GilCriterion, WallDampingHelpsAndWithoutItTheLimitIsColgates, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
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

}  // namespace
}  // namespace kmax::control::gil_criterion_test
