#include "control/sine_cosine.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace kmax::control::sine_cosine_test {

static_assert(radians_per_turn_fraction<double> * 4294967296.0 == 6.283185307179586476925286766559);

long double radians(TurnFraction angle) {
  return static_cast<long double>(angle) * (6.283185307179586476925286766559L / 4294967296.0L);
}

// Of sine or cosine, at every `stride`-th angle.
template <typename Scalar>
long double worst_error(std::uint64_t stride) {
  long double worst = 0.0L;
  for (std::uint64_t angle = 0; angle < (1ULL << 32); angle += stride) {
    const auto pair = sine_cosine<Scalar>(static_cast<TurnFraction>(angle));
    const long double truth = radians(static_cast<TurnFraction>(angle));
    worst = std::fmax(worst, std::fabs(static_cast<long double>(pair.sine) - std::sin(truth)));
    worst = std::fmax(worst, std::fabs(static_cast<long double>(pair.cosine) - std::cos(truth)));
  }
  return worst;
}

TEST(SineCosine, IsWithinOneAndAHalfUnitsOfTheLastPlaceInFloatAndOneInDouble) {
  const long double worst = worst_error<float>(1009);
  EXPECT_LT(worst * 16777216.0L, 1.5L);
  EXPECT_GT(worst * 16777216.0L, 0.5L) << "better than rounding alone allows: nothing was measured";
  EXPECT_LT(worst_error<double>(10007), 2.2e-16L);
}

// Too long by r^2/2 at most, and in the right direction.
TEST(SineCosine, TheFirstOrderIsRightToItsNextTerm) {
  long double length_error = 0.0L;
  long double direction_error = 0.0L;
  for (std::uint64_t angle = 0; angle < (1ULL << 32); angle += 10007) {
    const auto pair = sine_cosine_first_order<float>(static_cast<TurnFraction>(angle));
    const long double truth = radians(static_cast<TurnFraction>(angle));
    const auto sine = static_cast<long double>(pair.sine);
    const auto cosine = static_cast<long double>(pair.cosine);
    const long double length = std::hypot(sine, cosine);
    ASSERT_GT(length, 1.0L - 2e-7L) << angle;
    length_error = std::fmax(length_error, length - 1.0L);
    direction_error =
        std::fmax(direction_error, std::fabs(sine * std::cos(truth) - cosine * std::sin(truth)) / length);
  }
  EXPECT_LT(length_error, 1.91e-5L);
  EXPECT_GT(length_error, 1.8e-5L) << "better than the formula allows: nothing was measured";
  EXPECT_LT(direction_error, 2e-7L);
}

TEST(SineCosine, WholeQuartersAreExact) {
  const float sines[] = {0.0F, 1.0F, 0.0F, -1.0F, 0.0F};
  for (unsigned quarter = 0; quarter < 4; ++quarter) {
    const auto pair = sine_cosine<float>(quarter << 30);
    EXPECT_EQ(pair.sine, sines[quarter]);
    EXPECT_EQ(pair.cosine, sines[quarter + 1]);
  }
}

// The last angle of the turn, the first one, and both sides of every boundary between two table entries.
TEST(SineCosine, IsContinuousWhereTheTableEntryChangesAndAcrossTheWrap) {
  for (std::uint32_t entry = 0; entry < 512; ++entry) {
    const TurnFraction boundary = (entry << 23) + (1U << 22);
    const auto below = sine_cosine<float>(boundary - 1);
    const auto above = sine_cosine<float>(boundary);
    ASSERT_NEAR(below.sine, above.sine, 2.4e-7F) << entry;
    ASSERT_NEAR(below.cosine, above.cosine, 2.4e-7F) << entry;
  }
  EXPECT_NEAR(sine_cosine<float>(0xFFFFFFFFU).sine, -1.46e-9F, 1e-11F);
  EXPECT_EQ(sine_cosine<float>(0xFFFFFFFFU).cosine, 1.0F);
}

TEST(SineCosine, OppositeAnglesAreOppositeToTheBit) {
  for (std::uint64_t angle = 0; angle < (1ULL << 32); angle += 1000003) {
    const auto here = sine_cosine<float>(static_cast<TurnFraction>(angle));
    const auto opposite = sine_cosine<float>(static_cast<TurnFraction>(angle) + 0x80000000U);
    ASSERT_EQ(here.sine, -opposite.sine) << angle;
    ASSERT_EQ(here.cosine, -opposite.cosine) << angle;
  }
}

}  // namespace kmax::control::sine_cosine_test
