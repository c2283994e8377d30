#include "firmware/object_dictionary/capture_channel.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace kmax::firmware::capture_channel_test {
namespace {

// Numbers of the protocol: hosts in the field know them.
TEST(CaptureChannel, NumbersStay) {
  EXPECT_EQ(static_cast<int>(CaptureChannel::count), 4);
  EXPECT_EQ(static_cast<int>(CaptureChannel::voltage), 10);
  EXPECT_EQ(static_cast<int>(CaptureChannel::duty_c), 16);
  EXPECT_EQ(static_cast<int>(CaptureChannel::flags), 19);
  EXPECT_EQ(static_cast<int>(CaptureTrigger::excitation), 5);
  EXPECT_EQ(static_cast<int>(CaptureState::complete), 3);
}

TEST(CaptureChannel, EachHasItsOwnNameAndStandsInTheDictionarysListByItsNumber) {
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < capture_channel_count; ++i) {
    EXPECT_TRUE(seen.insert(names::capture_channel[i].name).second) << i;
    EXPECT_EQ(names::capture_channel[i].value, static_cast<std::int32_t>(i));
    EXPECT_EQ(names::capture_channel[i].name, text_of(static_cast<CaptureChannel>(i)).name);
  }
  EXPECT_EQ(text_of(CaptureChannel::magnetic_coefficient).name, "magnetic_coefficient");
}

TEST(CaptureChannel, AWordIsANumberInTheChannelsUnit) {
  constexpr double length = 3.834951969714103e-05;
  EXPECT_EQ(capture_value(CaptureChannel::force, std::bit_cast<std::uint32_t>(-1.5f), length), -1.5);
  // A count at the end of its range keeps its place, which a float32 in metres would not.
  EXPECT_EQ(capture_value(CaptureChannel::position, 0x80000001u, length), -2147483647.0 * length);
  EXPECT_EQ(capture_value(CaptureChannel::count, 0xFFFFFFFFu, length), -1.0);
  EXPECT_EQ(capture_value(CaptureChannel::flags, 0xFFFFFFFFu, length), 4294967295.0);
  EXPECT_DOUBLE_EQ(capture_value(CaptureChannel::electrical_angle, 0xC0000000u, length),
                   1.5 * std::numbers::pi);
}

TEST(CaptureFlag, BitsAreApart) {
  using namespace capture_flag;
  const std::uint32_t all[] = {inside,    force_limited, slew_limited,       ramping, armed,
                               saturated, count_valid,   excitation_started, fault};
  std::uint32_t seen = 0;
  for (const std::uint32_t bits : all) {
    EXPECT_EQ(seen & bits, 0u);
    seen |= bits;
  }
}

}  // namespace
}  // namespace kmax::firmware::capture_channel_test
