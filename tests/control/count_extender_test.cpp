#include "control/count_extender.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace kmax::control::count_extender_test {
namespace {

TEST(CountExtender, SixteenBitsWrapForwardsAndBackwards) {
  CountExtender<std::uint16_t> extender;
  extender.reset(0xFFFE, 65534);
  EXPECT_EQ(extender.update(0x0003), 65539);
  EXPECT_EQ(extender.update(0xFFFF), 65535);
  EXPECT_EQ(extender.update(0xFFFE), 65534);
}

TEST(CountExtender, ThirtyTwoBitsWrapForwardsAndBackwards) {
  CountExtender<std::uint32_t> extender;
  extender.reset(0xFFFFFFF0U, 4294967280LL);
  EXPECT_EQ(extender.update(0x00000010U), 4294967312LL);
  EXPECT_EQ(extender.update(0xFFFFFFFFU), 4294967295LL);
}

TEST(CountExtender, PassesTheLargestAndSmallestSignedValue) {
  CountExtender<std::uint32_t> extender;
  extender.reset(0x7FFFFFFFU);
  EXPECT_EQ(extender.count(), std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(extender.update(0x80000000U), 2147483648LL);
  EXPECT_EQ(extender.update(0x80000001U), 2147483649LL);
  extender.reset(0x80000000U);
  EXPECT_EQ(extender.count(), std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(extender.update(0x7FFFFFFFU), -2147483649LL);
}

TEST(CountExtender, WithoutACountTheRawValueIsSigned) {
  CountExtender<std::uint16_t> extender;
  extender.reset(0xFFFF);
  EXPECT_EQ(extender.count(), -1);
  EXPECT_EQ(extender.update(0), 0);
}

TEST(CountExtender, HalfTheRangeIsReadAsNegative) {
  CountExtender<std::uint16_t> short_counter;
  short_counter.reset(0, 0);
  EXPECT_EQ(short_counter.update(0x7FFF), 32767);
  EXPECT_EQ(short_counter.update(0xFFFF), -1);  // 0x8000 further: the other way round
  CountExtender<std::uint32_t> long_counter;
  long_counter.reset(5, 0);
  EXPECT_EQ(long_counter.update(0x80000005U), -2147483648LL);
}

template <typename Counter>
void follows_every_legal_walk(std::int64_t start, const std::vector<std::int32_t>& steps) {
  constexpr int shift = 32 - 8 * static_cast<int>(sizeof(Counter));
  CountExtender<Counter> extender;
  std::int64_t truth = start;
  extender.reset(static_cast<Counter>(truth), truth);
  for (const std::int32_t step : steps) {
    truth += step >> shift;
    RC_ASSERT(extender.update(static_cast<Counter>(truth)) == truth);
  }
}

RC_GTEST_PROP(CountExtender, SixteenBitWalks, (std::int32_t start)) {
  follows_every_legal_walk<std::uint16_t>(
      start, *rc::gen::container<std::vector<std::int32_t>>(200, rc::gen::arbitrary<std::int32_t>()));
  const auto wide = rc::gen::inRange<std::int32_t>(std::numeric_limits<std::int32_t>::min(),
                                                   std::numeric_limits<std::int32_t>::max());
  follows_every_legal_walk<std::uint16_t>(start, *rc::gen::container<std::vector<std::int32_t>>(200, wide));
}

RC_GTEST_PROP(CountExtender, ThirtyTwoBitWalks, (std::int32_t start)) {
  const auto wide = rc::gen::inRange<std::int32_t>(std::numeric_limits<std::int32_t>::min(),
                                                   std::numeric_limits<std::int32_t>::max());
  follows_every_legal_walk<std::uint32_t>(std::int64_t{start} * 1000,
                                          *rc::gen::container<std::vector<std::int32_t>>(200, wide));
}

// 24 h at 20 kHz and 1 m/s of 0.1 um counts is 8.64e11 counts, 201 wraps of 2^32. Ticks of 2^30 counts go
// through all.
TEST(CountExtender, ADayOfWrapsLosesNothing) {
  CountExtender<std::uint32_t> extender;
  extender.reset(0, 0);
  std::int64_t truth = 0;
  while (truth < 864'000'000'000LL) {
    truth += (1LL << 30) - 7;
    ASSERT_EQ(extender.update(static_cast<std::uint32_t>(truth)), truth);
  }
  while (truth > -864'000'000'000LL) {
    truth -= (1LL << 31) - 3;
    ASSERT_EQ(extender.update(static_cast<std::uint32_t>(truth)), truth);
  }
}

}  // namespace
}  // namespace kmax::control::count_extender_test
