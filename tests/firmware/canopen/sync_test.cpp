#include "firmware/canopen/sync.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <vector>

namespace kmax::firmware::canopen::sync_test {
namespace {

using drivers::CanFrame;
using Bytes = std::vector<std::uint8_t>;

CanFrame plain(std::uint32_t identifier = 0x080) {
  return {.identifier = identifier};
}

CanFrame counted(std::uint8_t counter) {
  return {.identifier = 0x080, .length = 1, .data = {counter}};
}

TEST(Sync, IsTakenWithAndWithoutCounter) {
  Sync sync;
  const auto without = sync.receive(plain());
  ASSERT_TRUE(without);
  EXPECT_EQ(without->counter, 0);
  const auto with = sync.receive(counted(240));
  ASSERT_TRUE(with);
  EXPECT_EQ(with->counter, 240);
  EXPECT_EQ(sync.counters().received, 2U);
}

TEST(Sync, OtherLengthsAreCountedAndNoSync) {
  Sync sync;
  for (std::uint8_t length = 2; length <= 8; ++length) {
    CanFrame frame = counted(1);
    frame.length = length;
    EXPECT_FALSE(sync.receive(frame)) << int{length};
  }
  EXPECT_EQ(sync.counters().wrong_length, 7U);
  EXPECT_EQ(sync.counters().received, 0U);
}

TEST(Sync, OtherFramesAreNotForIt) {
  Sync sync;
  EXPECT_FALSE(sync.receive(plain(0x081)));
  CanFrame frame = plain();
  frame.extended = true;
  EXPECT_FALSE(sync.receive(frame));
  frame = plain();
  frame.remote = true;
  EXPECT_FALSE(sync.receive(frame));
  sync.configure(0x8000'0085);
  EXPECT_EQ(sync.identifier(), 0x085U);
  EXPECT_FALSE(sync.receive(plain(0x080)));
  EXPECT_TRUE(sync.receive(plain(0x085)));
  EXPECT_EQ(sync.counters().received, 1U);
  EXPECT_EQ(sync.counters().wrong_length, 0U);
}

TEST(Sync, ChecksWhatIsWritten) {
  for (const std::uint32_t good : {0x080U, 0x8000'0080U, 0x0FFU, 0x100U, 0x181U, 0x6DFU}) {
    EXPECT_EQ(Sync::check(good), Abort::none) << good;
  }
  for (const std::uint32_t bad : {0x4000'0080U, 0x2000'0080U, 0x880U, 0x000U, 0x001U, 0x07FU, 0x180U, 0x581U,
                                  0x601U, 0x701U, 0x7E5U, 0x7FFU, 0xFFFF'FFFFU}) {
    EXPECT_EQ(Sync::check(bad), Abort::value_range) << bad;
  }
  for (const std::uint8_t good : Bytes{0, 2, 240}) EXPECT_EQ(Sync::check_overflow(good), Abort::none);
  for (const std::uint8_t bad : Bytes{1, 241, 255}) EXPECT_EQ(Sync::check_overflow(bad), Abort::value_range);
}

std::uint32_t lost(std::uint8_t overflow, std::initializer_list<std::uint8_t> counters) {
  Sync sync;
  sync.configure(0x080, overflow);
  for (const std::uint8_t counter : counters) EXPECT_TRUE(sync.receive(counted(counter)));
  return sync.counters().lost;
}

TEST(Sync, GapsInTheCounterAreCounted) {
  EXPECT_EQ(lost(5, {3, 4, 5, 1, 2}), 0U);
  EXPECT_EQ(lost(5, {3, 5}), 1U);
  EXPECT_EQ(lost(5, {4, 1}), 1U);
  EXPECT_EQ(lost(5, {4, 3}), 3U);
  EXPECT_EQ(lost(5, {5, 5}), 4U);
  EXPECT_EQ(lost(2, {1, 2, 1, 1}), 1U);
  EXPECT_EQ(lost(240, {239, 240, 1}), 0U);
  EXPECT_EQ(lost(240, {240, 240}), 239U);
  EXPECT_EQ(lost(0, {3, 9, 1}), 0U) << "the overflow value is not known";
}

TEST(Sync, ACounterThatCannotBeIsCountedButIsASync) {
  Sync sync;
  for (const std::uint8_t counter : Bytes{0, 241, 255}) {
    const auto tick = sync.receive(counted(counter));
    ASSERT_TRUE(tick);
    EXPECT_EQ(tick->counter, 0);
  }
  sync.configure(0x080, 10);
  EXPECT_TRUE(sync.receive(counted(10)));
  EXPECT_TRUE(sync.receive(counted(11)));
  EXPECT_TRUE(sync.receive(counted(5)));
  EXPECT_EQ(sync.counters().wrong_counter, 4U);
  EXPECT_EQ(sync.counters().lost, 0U) << "nothing to compare with";
  sync.receive(plain());
  sync.receive(counted(9));
  EXPECT_EQ(sync.counters().lost, 0U);
}

}  // namespace
}  // namespace kmax::firmware::canopen::sync_test
