#include "firmware/canopen/sdo_sink.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/firmware/canopen/in_memory_objects.hpp"

namespace kmax::firmware::canopen::sdo_sink_test {
namespace {

constexpr ObjectAddress text{0x2013, 0};  // 2 to 10 bytes
constexpr ObjectAddress domain = InMemoryObjects::domain;

struct SdoSinkTest : testing::Test {
  InMemoryObjects objects;
  std::array<std::uint8_t, 16> buffer{};
  SdoSink<InMemoryObjects> sink{objects, buffer};
};

TEST_F(SdoSinkTest, WritesWhatWasAppendedInOnePiece) {
  ASSERT_EQ(sink.begin(text, std::nullopt), Abort::none);
  EXPECT_EQ(sink.append(Bytes{1, 2, 3}), Abort::none);
  EXPECT_EQ(sink.append({}), Abort::none);
  EXPECT_EQ(sink.append(Bytes{4, 5, 6, 7, 8, 9, 10}), Abort::none);
  EXPECT_TRUE(objects.writes.empty());
  EXPECT_EQ(sink.check_complete(), Abort::none);
  EXPECT_EQ(sink.write(), Abort::none);
  EXPECT_EQ(objects.writes, (std::vector<InMemoryObjects::Written>{{text, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}}));
}

TEST_F(SdoSinkTest, AnnouncedLengthsAreJudgedBeforeTheFirstByte) {
  EXPECT_EQ(sink.begin(text, 1), Abort::too_short);
  EXPECT_EQ(sink.begin(text, 2), Abort::none);
  EXPECT_EQ(sink.begin(text, 10), Abort::none);
  EXPECT_EQ(sink.begin(text, 11), Abort::too_long);
  EXPECT_EQ(sink.begin(domain, 16), Abort::none);
  EXPECT_EQ(sink.begin(domain, 17), Abort::memory);
  EXPECT_EQ(sink.begin(domain, 60001), Abort::too_long);
  EXPECT_EQ(sink.begin(domain, UINT32_MAX), Abort::too_long);
  EXPECT_EQ(sink.begin({0x1000, 0}, 99), Abort::read_only) << "access before length";
}

TEST_F(SdoSinkTest, WhatIsTooMuchIsNotTaken) {
  ASSERT_EQ(sink.begin(text, 3), Abort::none);
  EXPECT_EQ(sink.append(Bytes(4)), Abort::too_long);
  EXPECT_EQ(sink.append(Bytes(3)), Abort::none);
  EXPECT_EQ(sink.append(Bytes(1)), Abort::too_long);
  ASSERT_EQ(sink.begin(text, std::nullopt), Abort::none);
  EXPECT_EQ(sink.append(Bytes(11)), Abort::too_long);
  ASSERT_EQ(sink.begin(domain, std::nullopt), Abort::none);
  EXPECT_EQ(sink.append(Bytes(16)), Abort::none);
  EXPECT_EQ(sink.append(Bytes(1)), Abort::memory);
}

TEST_F(SdoSinkTest, TooLittleIsFoundAtTheEnd) {
  ASSERT_EQ(sink.begin(text, 5), Abort::none);
  EXPECT_EQ(sink.append(Bytes(4)), Abort::none);
  EXPECT_EQ(sink.check_complete(), Abort::too_short);
  ASSERT_EQ(sink.begin(text, std::nullopt), Abort::none);
  EXPECT_EQ(sink.append(Bytes(1)), Abort::none);
  EXPECT_EQ(sink.check_complete(), Abort::too_short);
  EXPECT_EQ(sink.append(Bytes(1)), Abort::none);
  EXPECT_EQ(sink.check_complete(), Abort::none);
}

TEST_F(SdoSinkTest, EachBeginForgetsTheValueBefore) {
  ASSERT_EQ(sink.begin(domain, 16), Abort::none);
  ASSERT_EQ(sink.append(Bytes(16, 1)), Abort::none);
  ASSERT_EQ(sink.begin(domain, std::nullopt), Abort::none);
  ASSERT_EQ(sink.append(Bytes{2, 3}), Abort::none);
  ASSERT_EQ(sink.write(), Abort::none);
  EXPECT_EQ(objects.at(domain).value, (Bytes{2, 3}));
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_sink_test
