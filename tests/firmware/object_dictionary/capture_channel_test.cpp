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
  int number = 0;
  for (const CaptureTrigger one :
       {CaptureTrigger::now, CaptureTrigger::contact, CaptureTrigger::force, CaptureTrigger::velocity,
        CaptureTrigger::fault, CaptureTrigger::excitation}) {
    EXPECT_EQ(names::capture_trigger[number].value, number);
    EXPECT_EQ(static_cast<int>(one), number++);
  }
  number = 0;
  for (const CaptureState one :
       {CaptureState::idle, CaptureState::waiting, CaptureState::running, CaptureState::complete}) {
    EXPECT_EQ(names::capture_state[number].value, number);
    EXPECT_EQ(static_cast<int>(one), number++);
  }
  number = 0;
  for (const CaptureCommand one : {CaptureCommand::stop, CaptureCommand::arm}) {
    EXPECT_EQ(names::capture_command[number].value, number);
    EXPECT_EQ(static_cast<int>(one), number++);
  }
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

TEST(CaptureFlag, BitsStay) {
  using namespace capture_flag;
  const std::uint32_t all[] = {inside,    force_limited, slew_limited,       ramping, armed,
                               saturated, count_valid,   excitation_started, fault};
  std::uint32_t bit = 1;
  for (const std::uint32_t bits : all) {
    EXPECT_EQ(bits, bit == 1u << 8 ? 0xFF00u : bit) << "hosts know them";
    bit <<= 1;
  }
}

}  // namespace
}  // namespace kmax::firmware::capture_channel_test
