#include "control/finite.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace kmax::control::finite_test {

RC_GTEST_PROP(Finite, AgreesWithTheStandardLibraryOnEveryPattern, (std::uint32_t bits)) {
  const auto value = std::bit_cast<float>(bits);
  RC_ASSERT(is_finite(value) == std::isfinite(value));
}

TEST(Finite, KnowsTheSpecialValues) {
  EXPECT_FALSE(is_finite(std::nanf("")));
  EXPECT_FALSE(is_finite(INFINITY));
  EXPECT_FALSE(is_finite(-INFINITY));
  EXPECT_TRUE(is_finite(std::numeric_limits<float>::max()));
  EXPECT_TRUE(is_finite(std::numeric_limits<float>::denorm_min()));
  EXPECT_TRUE(is_finite(-0.0f));
}

TEST(Finite, SaturateBringsInfinitiesBackAndKeepsNaN) {
  EXPECT_EQ(saturate(INFINITY), std::numeric_limits<float>::max());
  EXPECT_EQ(saturate(-INFINITY), -std::numeric_limits<float>::max());
  EXPECT_EQ(saturate(-2.5f), -2.5f);
  EXPECT_TRUE(std::isnan(saturate(std::nanf(""))));
}

TEST(Magnitude, KeepsANotANumberAndDropsTheSign) {
  EXPECT_EQ(magnitude(-2.5F), 2.5F);
  EXPECT_EQ(magnitude(2.5), 2.5);
  EXPECT_FALSE(std::signbit(magnitude(-0.0F)));
  EXPECT_TRUE(std::isinf(magnitude(-INFINITY)));
  EXPECT_TRUE(std::isnan(magnitude(std::nanf(""))));
}

TEST(BoundedShare, StaysBetweenNothingAndAll) {
  EXPECT_EQ(bounded_share(0.3F), 0.3F);
  EXPECT_EQ(bounded_share(-0.3F), 0.0F);
  EXPECT_EQ(bounded_share(1.5), 1.0);
  EXPECT_EQ(bounded_share(std::nanf("")), 1.0F);
}

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

}  // namespace kmax::control::finite_test
