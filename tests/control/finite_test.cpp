#include "control/finite.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>

namespace kmax::control {
namespace {

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

}  // namespace
}  // namespace kmax::control
