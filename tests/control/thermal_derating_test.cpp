#include "control/thermal_derating.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace kmax::control::thermal_derating_test {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float largest = std::numeric_limits<float>::max();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

TEST(ThermalDerating, FallsFromOneToZeroOnALine) {
  EXPECT_EQ(thermal_derating(-40.0f, 100.0f, 120.0f), 1.0f);
  EXPECT_EQ(thermal_derating(100.0f, 100.0f, 120.0f), 1.0f);
  EXPECT_FLOAT_EQ(thermal_derating(105.0f, 100.0f, 120.0f), 0.75f);
  EXPECT_FLOAT_EQ(thermal_derating(119.0f, 100.0f, 120.0f), 0.05f);
  EXPECT_EQ(thermal_derating(120.0f, 100.0f, 120.0f), 0.0f);
  EXPECT_EQ(thermal_derating(1000.0f, 100.0f, 120.0f), 0.0f);
}

TEST(ThermalDerating, NothingByWhatIsNoTemperature) {
  for (const float bad : {not_a_number, infinity, -infinity}) {
    EXPECT_EQ(thermal_derating(bad, 100.0f, 120.0f), 0.0f);
    EXPECT_EQ(thermal_derating(20.0f, bad, 120.0f), 0.0f);
    EXPECT_EQ(thermal_derating(20.0f, 100.0f, bad), 0.0f);
  }
}

TEST(ThermalDerating, BoundsTheWrongWayRoundAreAStepAtTheLimit) {
  EXPECT_EQ(thermal_derating(99.0f, 120.0f, 100.0f), 1.0f);
  EXPECT_EQ(thermal_derating(100.0f, 120.0f, 100.0f), 0.0f);
  EXPECT_EQ(thermal_derating(100.0f, 100.0f, 100.0f), 0.0f);
  EXPECT_EQ(thermal_derating(99.9f, 100.0f, 100.0f), 1.0f);
}

RC_GTEST_PROP(ThermalDerating, IsAShareAndNeverRises, (float one, float other, float start, float limit)) {
  RC_PRE(std::isfinite(one) && std::isfinite(other) && std::isfinite(start) && std::isfinite(limit));
  const float cooler = std::min(one, other), hotter = std::max(one, other);
  const float more = thermal_derating(cooler, start, limit), less = thermal_derating(hotter, start, limit);
  RC_ASSERT(more >= 0.0f && more <= 1.0f && less >= 0.0f && less <= more);
}

// Without a step: neighbouring temperatures, neighbouring shares.
RC_GTEST_PROP(ThermalDerating, IsContinuous, ()) {
  const float start = static_cast<float>(*rc::gen::inRange(-100, 300));
  const float limit = start + static_cast<float>(*rc::gen::inRange(1, 100));
  for (float t = start - 1.0f; t < limit + 1.0f; t += 0.01f) {
    const float step = thermal_derating(t, start, limit) - thermal_derating(t + 0.01f, start, limit);
    RC_ASSERT(step <= 0.0101f / (limit - start) + 1e-5f);
  }
}

TEST(ThermalDerating, BoundsFarApartDoNotOverflow) {
  EXPECT_FLOAT_EQ(thermal_derating(0.0f, -largest, largest), 0.5f);
}

}  // namespace kmax::control::thermal_derating_test
