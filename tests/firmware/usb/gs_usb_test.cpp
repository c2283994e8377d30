// Numbers of Linux' drivers/net/can/usb/gs_usb.c and of RM0090, CAN_BTR.
#include "firmware/usb/gs_usb.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

namespace kmax::firmware::usb::gs::gs_usb_test {

using Timing = std::array<std::uint32_t, 5>;  // prop_seg, phase_seg1, phase_seg2, sjw, brp

bool allowed(const Timing& timing) {
  std::vector<std::uint8_t> bytes(bit_timing_bytes);
  for (std::size_t i = 0; i < timing.size(); ++i) put_word(bytes, 4 * i, timing[i]);
  return within(TimingLimits{}, bytes);
}

TEST(GsUsbTiming, EachNumberHasBothItsBounds) {
  constexpr Timing good{1, 12, 6, 2, 3};
  ASSERT_TRUE(allowed(good));
  struct Bound {
    std::size_t place;
    std::uint32_t lowest, highest;
  };
  for (const Bound& bound : {Bound{0, 0, 4}, {1, 0, 15}, {2, 1, 8}, {3, 1, 4}, {4, 1, 1024}}) {
    for (const auto& [number, is_good] : {std::pair{bound.lowest, true},
                                          {bound.highest, true},
                                          {bound.highest + 1, false},
                                          {0x1'0001U, false},
                                          {0x8000'0000U, false},
                                          {0xFFFF'FFFFU, false}}) {
      Timing timing = good;
      timing[bound.place] = number;
      EXPECT_EQ(allowed(timing), is_good) << bound.place << ": " << number;
    }
    Timing timing = good;
    timing[bound.place] = bound.lowest - 1;
    EXPECT_FALSE(allowed(timing)) << bound.place;
  }
  EXPECT_FALSE(allowed({0, 0, 6, 2, 3})) << "both parts of segment 1 are none";
  EXPECT_TRUE(allowed({16, 0, 6, 2, 3}));
  // Their sum is not taken before each is known to be small.
  EXPECT_FALSE(allowed({0xFFFF'FFFF, 2, 6, 2, 3}));
}

TEST(GsUsbFrame, HasTheDriversLayout) {
  const HostFrame frame{.echo = 0x0403'0201,
                        .channel = 5,
                        .flags = 6,
                        .frame = {.identifier = 0x1234'5678 & 0x1FFF'FFFF,
                                  .extended = true,
                                  .length = 8,
                                  .data = {1, 2, 3, 4, 5, 6, 7, 8}}};
  const auto bytes = encoded(frame);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, frame_bytes>{1, 2, 3, 4, 0x78, 0x56, 0x34, 0x92, 8, 5,
                                                          6, 0, 1, 2, 3,    4,    5,    6,    7, 8}));
  const HostFrame again = decoded(bytes);
  EXPECT_EQ(again.echo, frame.echo);
  EXPECT_EQ(again.channel, 5);
  EXPECT_EQ(again.flags, 6);
  EXPECT_EQ(again.frame, frame.frame);
}

TEST(GsUsbFrame, AnErrorFrameIsNoneToSend) {
  auto bytes = encoded({.frame = {.identifier = 0x7FF, .length = 0}});
  EXPECT_TRUE(decoded(bytes).frame.valid());
  bytes[7] |= 0x20;
  EXPECT_FALSE(decoded(bytes).frame.valid());
}

TEST(GsUsbNumbers, AreTheDrivers) {
  EXPECT_EQ(static_cast<int>(Request::host_format), 0);
  EXPECT_EQ(static_cast<int>(Request::bit_timing), 1);
  EXPECT_EQ(static_cast<int>(Request::mode), 2);
  EXPECT_EQ(static_cast<int>(Request::bus_errors), 3);
  EXPECT_EQ(static_cast<int>(Request::bit_timing_constants), 4);
  EXPECT_EQ(static_cast<int>(Request::device_configuration), 5);
  EXPECT_EQ(static_cast<int>(Request::timestamp), 6);
  EXPECT_EQ(static_cast<int>(Request::identify), 7);
  EXPECT_EQ(little_endian_host, 0xBEEFU);
  EXPECT_EQ(features, 0U);
  EXPECT_EQ((std::array{host_format_bytes, bit_timing_bytes, mode_bytes, constants_bytes, configuration_bytes,
                        frame_bytes}),
            (std::array<std::size_t, 6>{4, 20, 8, 40, 12, 20}));
  EXPECT_EQ(flag_overflow, 1);
  EXPECT_EQ(no_echo, 0xFFFF'FFFFU);
  EXPECT_EQ(id_extended, 0x8000'0000U);
  EXPECT_EQ(id_remote, 0x4000'0000U);
  EXPECT_EQ(id_error, 0x2000'0000U);
  constexpr TimingLimits limits;
  EXPECT_EQ(limits.prescaler_step, 1U);
}

}  // namespace kmax::firmware::usb::gs::gs_usb_test
