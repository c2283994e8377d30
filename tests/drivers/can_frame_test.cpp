#include "drivers/can_frame.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::can_frame_test {

TEST(CanFrame, ValidKnowsItsRanges) {
  EXPECT_TRUE((CanFrame{.identifier = 0x7FF, .length = 8}.valid()));
  EXPECT_FALSE((CanFrame{.identifier = 0x800}.valid()));
  EXPECT_TRUE((CanFrame{.identifier = 0x1FFFFFFF, .extended = true}.valid()));
  EXPECT_FALSE((CanFrame{.identifier = 0x20000000, .extended = true}.valid()));
  EXPECT_FALSE((CanFrame{.length = 9}.valid()));
}

TEST(CanFrame, EqualWhereTheBusIsEqual) {
  const CanFrame frame{.identifier = 1, .length = 2, .data = {1, 2, 3}};
  EXPECT_EQ(frame, (CanFrame{.identifier = 1, .length = 2, .data = {1, 2, 99}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .length = 2, .data = {1, 9}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .extended = true, .length = 2, .data = {1, 2}}));
  EXPECT_EQ((CanFrame{.remote = true, .length = 2, .data = {1}}), (CanFrame{.remote = true, .length = 2}));
}

TEST(CanFrame, ArbitrationOfTheSameUpperBits) {
  const CanFrame data{.identifier = 0x123}, remote{.identifier = 0x123, .remote = true};
  const CanFrame extended{.identifier = 0x123U << 18, .extended = true};
  EXPECT_LT(can_arbitration(data), can_arbitration(remote));
  EXPECT_LT(can_arbitration(remote), can_arbitration(extended));
  EXPECT_LT(can_arbitration(extended), can_arbitration(CanFrame{.identifier = 0x124}));
}

}  // namespace kmax::drivers::can_frame_test
