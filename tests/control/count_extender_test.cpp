#include "control/count_extender.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace kmax::control::count_extender_test {

TEST(CountExtender, WithoutACountTheRawValueIsSigned) {
  CountExtender<std::uint16_t> short_counter;
  short_counter.reset(0xFFFF);
  EXPECT_EQ(short_counter.count(), -1);
  EXPECT_EQ(short_counter.update(0), 0);
  CountExtender<std::uint32_t> long_counter;
  for (const std::uint32_t raw : {0x7FFFFFFFU, 0x80000000U}) {
    long_counter.reset(raw);
    EXPECT_EQ(long_counter.count(), static_cast<std::int32_t>(raw));
  }
  EXPECT_EQ(long_counter.update(0x7FFFFFFFU), -2147483649LL);
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

TEST(CountExtender, APeekSaysWhatAnUpdateWouldAndChangesNothing) {
  CountExtender<std::uint16_t> counter;
  EXPECT_EQ(counter.count(), 0);
  EXPECT_EQ(counter.peek(3), 3);
  counter.reset(0xFFFE, 100'000);
  EXPECT_EQ(counter.peek(3), 100'005);
  EXPECT_EQ(counter.count(), 100'000);
  EXPECT_EQ(counter.peek(0xFFF0), 99'986);
  EXPECT_EQ(counter.update(3), 100'005);
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

// Starts of up to 2e12: 24 h at 20 kHz and 1 m/s of 0.1 um counts is 8.64e11.
RC_GTEST_PROP(CountExtender, FollowsEveryLegalWalk, (std::int32_t start)) {
  const auto steps = [] {
    return *rc::gen::container<std::vector<std::int32_t>>(
        200, rc::gen::inRange<std::int32_t>(std::numeric_limits<std::int32_t>::min(),
                                            std::numeric_limits<std::int32_t>::max()));
  };
  follows_every_legal_walk<std::uint16_t>(start, steps());
  follows_every_legal_walk<std::uint16_t>(
      start, *rc::gen::container<std::vector<std::int32_t>>(200, rc::gen::arbitrary<std::int32_t>()));
  follows_every_legal_walk<std::uint32_t>(std::int64_t{start} * 1000, steps());
}

}  // namespace kmax::control::count_extender_test
