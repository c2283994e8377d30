#include "host_tools/device/serial/identification_reply.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/server.hpp"
#include "tests/host_tools/fake_device.hpp"

namespace kmax::device::identification::identification_reply_test {

std::vector<std::uint8_t> with_crc(std::vector<std::uint8_t> frame) {
  const auto crc = firmware::modbus::crc_of(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

/// What the firmware's own server answers.
std::vector<std::uint8_t> genuine_frame() {
  host_tools_test::FakeDevice device;
  firmware::modbus::Server server(device);
  const std::uint8_t request[] = {43, 14, 2, 0};
  std::array<std::uint8_t, firmware::modbus::pdu_size_max> response{};
  const auto length = server.process(request, response);
  std::vector<std::uint8_t> frame{1};
  frame.insert(frame.end(), response.begin(), response.begin() + static_cast<std::ptrdiff_t>(length));
  return with_crc(frame);
}

TEST(IdentificationReply, TheFirmwaresOwnAnswerIsUnderstood) {
  const auto frame = genuine_frame();
  const auto page = parse(frame, 1);
  ASSERT_TRUE(page.has_value());
  EXPECT_EQ(page->objects.at(0), "Kmax");
  EXPECT_EQ(page->objects.at(5), "fake board");
  EXPECT_FALSE(page->next_object.has_value());
}

TEST(IdentificationReply, TheLengthIsKnownOnlyWhenTheLastObjectsIs) {
  const auto frame = genuine_frame();
  for (std::size_t received = 0; received < frame.size(); ++received) {
    const auto length = frame_length(std::span(frame).first(received));
    EXPECT_TRUE(length == 0 || length == frame.size()) << received;
    EXPECT_FALSE(parse(std::span(frame).first(received), 1).has_value());
  }
  EXPECT_EQ(frame_length(frame), frame.size());
}

TEST(IdentificationReply, MoreFollows) {
  const auto page = parse(with_crc({1, 43, 14, 2, 0x82, 0xFF, 4, 1, 0, 1, 'K'}), 1);
  ASSERT_TRUE(page.has_value());
  EXPECT_EQ(page->next_object, 4);
}

TEST(IdentificationReply, OthersAreNotTakenForIt) {
  EXPECT_FALSE(parse(genuine_frame(), 2).has_value());
  EXPECT_FALSE(parse(with_crc({1, 43 | 0x80, 1}), 1).has_value());
  EXPECT_EQ(frame_length(with_crc({1, 43 | 0x80, 1})), 5u);
  EXPECT_FALSE(parse(with_crc({1, 43, 13, 2, 0x82, 0, 0, 0}), 1).has_value());
}

RC_GTEST_PROP(IdentificationReply, NoSingleByteMayChange, ()) {
  auto frame = genuine_frame();
  frame[*rc::gen::inRange<std::size_t>(0, frame.size())] ^= *rc::gen::inRange<std::uint8_t>(1, 255);
  RC_ASSERT(!parse(frame, 1).has_value());
}

RC_GTEST_PROP(IdentificationReply, NoiseIsSurvived, (const std::vector<std::uint8_t>& noise)) {
  frame_length(noise);
  RC_ASSERT(!parse(noise, 1).has_value());
}

TEST(IdentificationReply, Names) {
  EXPECT_EQ(name_of(0), "vendor_name");
  EXPECT_EQ(name_of(5), "model_name");
  EXPECT_EQ(name_of(128), "object_128");
}

}  // namespace kmax::device::identification::identification_reply_test
