#include "control/saturated_difference.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace kmax::control::saturated_difference_test {

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

// Up to 2^62 - 1 on both sides of zero it is the same function.
RC_GTEST_PROP(CountDifference, IsTheSaturatedOneForCountsBelowTwoToThe62, (std::int64_t a, std::int64_t b)) {
  const int shift_a = *rc::gen::inRange(2, 64);
  const int shift_b = *rc::gen::inRange(2, 64);
  const std::int64_t to = a >> shift_a;
  const std::int64_t from = b >> shift_b;
  if (to > -(1LL << 62) && from > -(1LL << 62))
    RC_ASSERT(count_difference(to, from) == saturated_difference(to, from));
  constexpr std::int64_t edge = (1LL << 62) - 1;
  RC_ASSERT(count_difference(edge, -edge) == largest);
  RC_ASSERT(count_difference(-edge, edge) == smallest);
  RC_ASSERT(count_difference(from + largest, from) == largest);
  RC_ASSERT(count_difference(from + smallest, from) == smallest);
}

RC_GTEST_PROP(DifferenceToFourBits, IsTheDifferenceCutToItsRange, (std::int32_t from)) {
  const std::int32_t to = *rc::gen::oneOf(
      rc::gen::arbitrary<std::int32_t>(),
      rc::gen::element(std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::min()),
      rc::gen::map(rc::gen::inRange(-20, 20), [&](int by) {
        return static_cast<std::int32_t>(std::clamp(std::int64_t{from} + by, smallest, largest));
      }));
  RC_ASSERT(difference_to_4_bits(to, from) == std::clamp<std::int64_t>(std::int64_t{to} - from, -8, 7));
}

}  // namespace kmax::control::saturated_difference_test
