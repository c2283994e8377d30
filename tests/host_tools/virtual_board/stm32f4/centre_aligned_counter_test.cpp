#include "host_tools/virtual_board/stm32f4/centre_aligned_counter.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kmax::virtual_board::centre_aligned_counter_test {

TEST(CentreAlignedCounter, StoppedItStandsStill) {
  CentreAlignedCounter counter;
  counter.set_count(17);
  EXPECT_EQ(counter.count(123'456), 17U);
  EXPECT_EQ(counter.next_turn(), never);
}

TEST(CentreAlignedCounter, TopOfOneTurnsAtEachTick) {
  CentreAlignedCounter counter;
  counter.start(10, 3, 1);
  EXPECT_EQ(counter.next_turn(), 13U);
  counter.turn(3, 1);
  EXPECT_EQ(counter.count(13), 1U);
  EXPECT_TRUE(counter.down());
  EXPECT_EQ(counter.next_turn(), 16U);
}

TEST(CentreAlignedCounter, StopKeepsCountAndDirection) {
  CentreAlignedCounter counter;
  counter.start(0, 2, 100);
  counter.turn(2, 100);
  counter.stop(200 + 2 * 30);
  EXPECT_EQ(counter.count(99'999), 70U);
  EXPECT_TRUE(counter.down());
  counter.start(1000, 2, 100);
  EXPECT_EQ(counter.next_turn(), 1000 + 2 * 70);
}

// Skipping must not be told from passing each turn.
RC_GTEST_PROP(CentreAlignedCounter, SkippingEqualsTurning, ()) {
  const auto top = *rc::gen::inRange<std::uint32_t>(1, 50);
  const auto tick = *rc::gen::inRange<BoardTime>(1, 20);
  const auto begin = *rc::gen::inRange<BoardTime>(0, 1000);
  const auto now = begin + *rc::gen::inRange<BoardTime>(0, 100'000);
  CentreAlignedCounter stepped, skipped;
  stepped.start(begin, tick, top);
  skipped.start(begin, tick, top);
  while (stepped.next_turn() <= now) stepped.turn(tick, top);
  while (skipped.next_turn() <= now) {
    skipped.turn(tick, top);
    skipped.skip_whole_periods(now);
  }
  RC_ASSERT(stepped.count(now) == skipped.count(now));
  RC_ASSERT(stepped.down() == skipped.down());
  RC_ASSERT(stepped.next_turn() == skipped.next_turn());
}

}  // namespace kmax::virtual_board::centre_aligned_counter_test
