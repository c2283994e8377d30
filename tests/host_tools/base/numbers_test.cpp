#include "host_tools/base/numbers.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace kmax::device::number_text_test::numbers_test {

TEST(NumberText, IsShortAndPlainWherePeopleReadIt) {
  EXPECT_EQ(number_text(2.4f), "2.4");
  EXPECT_EQ(number_text(3580.0f), "3580");
  EXPECT_EQ(number_text(0.0001f), "0.0001");
  EXPECT_EQ(number_text(1e-6f), "1e-6");
  EXPECT_EQ(number_text(1e6), "1e6");
  EXPECT_EQ(number_text(1234567.0), "1234567");
  EXPECT_EQ(number_text(999999.0), "999999");
  EXPECT_EQ(number_text(-2.5e-7), "-2.5e-7");
  EXPECT_EQ(number_text(1e100), "1e100");
  EXPECT_EQ(number_text(0.0), "0");
  EXPECT_EQ(number_text(-0.0), "0");
}

TEST(NumberText, CannotBreakOnWhatADeviceMaySend) {
  EXPECT_EQ(number_text(std::numeric_limits<float>::infinity()), "inf");
  EXPECT_EQ(number_text(-std::numeric_limits<float>::infinity()), "-inf");
  EXPECT_EQ(number_text(std::numeric_limits<float>::quiet_NaN()), "nan");
  EXPECT_EQ(number_text(std::numeric_limits<double>::denorm_min()), "5e-324");
  EXPECT_FALSE(number_text(std::numeric_limits<double>::max()).empty());
}

TEST(ShortestDouble, HasTheTextOfTheFloat) {
  EXPECT_EQ(shortest_double(2.4f), 2.4);
  EXPECT_EQ(shortest_double(0.1f), 0.1);
  EXPECT_EQ(shortest_double(std::numeric_limits<float>::max()), 3.4028235e38);
}

RC_GTEST_PROP(NumberText, EveryFiniteFloatComesBack, (std::uint32_t pattern)) {
  const auto value = std::bit_cast<float>(pattern);
  RC_PRE(std::isfinite(value));
  RC_ASSERT(std::strtof(number_text(value).c_str(), nullptr) == value);
  RC_ASSERT(static_cast<float>(shortest_double(value)) == value);
}

RC_GTEST_PROP(NumberText, EveryFiniteDoubleComesBack, (std::uint64_t pattern)) {
  const auto value = std::bit_cast<double>(pattern);
  RC_PRE(std::isfinite(value));
  RC_ASSERT(std::strtod(number_text(value).c_str(), nullptr) == value);
}

}  // namespace kmax::device::number_text_test::numbers_test
