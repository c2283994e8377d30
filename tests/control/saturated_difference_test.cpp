#include "control/saturated_difference.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace kmax::control {
namespace {

constexpr std::int64_t largest = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t smallest = std::numeric_limits<std::int32_t>::min();

TEST(SaturatedDifference, EdgesOfBothRanges) {
  constexpr std::int64_t far = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(saturated_difference(largest, 0), largest);
  EXPECT_EQ(saturated_difference(largest + 1, 0), largest);
  EXPECT_EQ(saturated_difference(smallest, 0), smallest);
  EXPECT_EQ(saturated_difference(smallest - 1, 0), smallest);
  EXPECT_EQ(saturated_difference(1LL << 32, 0), largest);
  EXPECT_EQ(saturated_difference(far, far - 3), 3);
  EXPECT_EQ(saturated_difference(far, -far), largest);
  EXPECT_EQ(saturated_difference(-far, far), smallest);
  EXPECT_EQ(saturated_difference(0, std::numeric_limits<std::int64_t>::min()), largest);
}

RC_GTEST_PROP(SaturatedDifference, IsTheClampedDifference, (std::int64_t to, std::int32_t offset)) {
  const int shift = *rc::gen::inRange(0, 31);
  __extension__ using Wide = __int128;
  const auto from = static_cast<std::int64_t>(std::clamp<Wide>(Wide{to} - (Wide{offset} << shift),
                                                               std::numeric_limits<std::int64_t>::min(),
                                                               std::numeric_limits<std::int64_t>::max()));
  const Wide exact = std::clamp<Wide>(Wide{to} - from, smallest, largest);
  RC_ASSERT(saturated_difference(to, from) == static_cast<std::int32_t>(exact));
}

}  // namespace
}  // namespace kmax::control
