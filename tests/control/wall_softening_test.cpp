#include "control/wall_softening.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace kmax::control::wall_softening_test {

using Softening = WallSoftening<float>;

RC_GTEST_PROP(WallSoftening, NeverRisesAndKeepsItsLeast, ()) {
  WallSofteningConfig<float> config;
  config.halving_time = *rc::gen::element(0.0F, 0.001F, 0.1F, 10.0F);
  config.least = *rc::gen::element(0.0F, 0.05F, 0.5F, 1.0F);
  const auto c = Softening::prepare(config, *rc::gen::element(5e-5F, 2e-3F));
  Softening softening;
  float before = 1.0F;
  for (int n = 0; n < 3000; ++n) {
    const bool unstable = *rc::gen::inRange(0, 3) == 0;
    const float factor = softening.update(c, unstable);
    RC_ASSERT(factor <= before && factor >= config.least);
    RC_ASSERT(unstable || factor == before);
    RC_ASSERT(factor == softening.factor());
    before = factor;
    if (n % 100 == 0) n += 50;
  }
  softening.reset();
  RC_ASSERT(softening.factor() == 1.0F);
}

TEST(WallSoftening, HalvesInItsTimeAtEveryRate) {
  for (const double rate : {500.0, 1000.0, 20000.0}) {
    const auto c = Softening::prepare({}, static_cast<float>(1.0 / rate));
    Softening softening;
    for (int n = 0; n < static_cast<int>(0.1 * rate + 0.5); ++n) softening.update(c, true);
    EXPECT_NEAR(static_cast<double>(softening.factor()), 0.5, 0.005) << rate;
  }
}

TEST(WallSoftening, ComesToRestAtItsLeast) {
  const auto c = Softening::prepare({}, 5e-5F);
  Softening softening;
  for (int n = 0; n < 1'000'000; ++n) softening.update(c, true);
  EXPECT_EQ(softening.factor(), 0.05F);
}

TEST(WallSoftening, TakesAnyConfiguration) {
  for (const float odd :
       {-1.0F, 0.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const auto c = Softening::prepare({odd, odd}, 5e-5F);
    Softening softening;
    for (int n = 0; n < 100; ++n) {
      const float factor = softening.update(c, true);
      EXPECT_TRUE(factor >= 0.0F && factor <= 1.0F) << odd;
    }
  }
}

}  // namespace kmax::control::wall_softening_test
