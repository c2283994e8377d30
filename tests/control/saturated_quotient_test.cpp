#include "control/saturated_quotient.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control::saturated_quotient_test {

constexpr double largest = std::numeric_limits<double>::max();

TEST(SaturatedQuotient, ZerosInfinitiesAndNotANumber) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double tiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(saturated_quotient(6.0, 2.0), 3.0);
  EXPECT_EQ(saturated_quotient(0.0, 0.0), 0.0);
  EXPECT_EQ(saturated_quotient(0.0, -0.0), 0.0);
  EXPECT_EQ(saturated_quotient(1.0, 0.0), largest);
  EXPECT_EQ(saturated_quotient(1.0, -0.0), largest);
  EXPECT_EQ(saturated_quotient(-1.0, 0.0), -largest);
  EXPECT_EQ(saturated_quotient(1.0, tiny), largest);
  EXPECT_EQ(saturated_quotient(-1.0, tiny), -largest);
  EXPECT_TRUE(std::isnan(saturated_quotient(nan, 0.0)));
  EXPECT_TRUE(std::isnan(saturated_quotient(0.0, nan)));
  EXPECT_TRUE(std::isnan(saturated_quotient(1.0, nan)));
}

RC_GTEST_PROP(SaturatedQuotient, FiniteForFinite, (float numerator, float denominator)) {
  RC_PRE(std::isfinite(numerator) && std::isfinite(denominator));
  const float quotient = saturated_quotient(numerator, denominator);
  RC_ASSERT(std::isfinite(quotient));
  if (denominator != 0.0f && std::isfinite(numerator / denominator))
    RC_ASSERT(quotient == numerator / denominator);
}

}  // namespace kmax::control::saturated_quotient_test
