#include "drivers/can_frame.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::can_frame_test {

TEST(CanFrame, ValidKnowsItsRanges) {
  EXPECT_TRUE((CanFrame{.identifier = 0x7FF, .length = 8}.valid()));
  EXPECT_FALSE((CanFrame{.identifier = 0x800}.valid()));
  EXPECT_TRUE((CanFrame{.identifier = 0x1FFFFFFF, .extended = true}.valid()));
  EXPECT_FALSE((CanFrame{.identifier = 0x20000000, .extended = true}.valid()));
  EXPECT_FALSE((CanFrame{.length = 9}.valid()));
  EXPECT_TRUE(CanFrame{}.valid());
}

TEST(CanFrame, EqualWhereTheBusIsEqual) {
  const CanFrame frame{.identifier = 1, .length = 2, .data = {1, 2, 3}};
  EXPECT_EQ(frame, (CanFrame{.identifier = 1, .length = 2, .data = {1, 2, 99}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .length = 2, .data = {1, 9}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .extended = true, .length = 2, .data = {1, 2}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 2, .length = 2, .data = {1, 2}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .remote = true, .length = 2, .data = {1, 2}}));
  EXPECT_FALSE(frame == (CanFrame{.identifier = 1, .length = 3, .data = {1, 2, 3}}));
  EXPECT_EQ((CanFrame{.remote = true, .length = 2, .data = {1}}), (CanFrame{.remote = true, .length = 2}));
  CanFrame one{.length = 8}, other{.length = 8};
  one.data.fill(0x55);
  for (std::uint8_t& byte : other.data) {
    EXPECT_FALSE(one == other);
    byte = 0x55;
  }
  EXPECT_EQ(one, other);
}

// ISO 11898-1: 11 bits, RTR or SRR, IDE, the other 18 bits, RTR.
TEST(CanFrame, ArbitrationIsTheFieldAsTheBusSeesIt) {
  EXPECT_EQ(can_arbitration({.identifier = 0x7FF}), 0xFFE0'0000U);
  EXPECT_EQ(can_arbitration({.identifier = 1}), 0x0020'0000U);
  EXPECT_EQ(can_arbitration({.identifier = 1, .remote = true}), 0x0030'0000U);
  EXPECT_EQ(can_arbitration({.identifier = 0, .extended = true}), 0x0018'0000U);
  EXPECT_EQ(can_arbitration({.identifier = 1, .extended = true}), 0x0018'0002U);
  EXPECT_EQ(can_arbitration({.identifier = 1, .extended = true, .remote = true}), 0x0018'0003U);
  EXPECT_EQ(can_arbitration({.identifier = 0x0003'FFFF, .extended = true}), 0x001F'FFFEU);
  EXPECT_EQ(can_arbitration({.identifier = 0x0004'0000, .extended = true}), 0x0038'0000U);
  EXPECT_EQ(can_arbitration({.identifier = 0x1FFF'FFFF, .extended = true, .remote = true}), 0xFFFF'FFFFU);
}

TEST(CanFrame, ArbitrationOfTheSameUpperBits) {
  const CanFrame data{.identifier = 0x123}, remote{.identifier = 0x123, .remote = true};
  const CanFrame extended{.identifier = 0x123U << 18, .extended = true};
  EXPECT_LT(can_arbitration(data), can_arbitration(remote));
  EXPECT_LT(can_arbitration(remote), can_arbitration(extended));
  EXPECT_LT(can_arbitration(extended), can_arbitration(CanFrame{.identifier = 0x124}));
}

}  // namespace kmax::drivers::can_frame_test
