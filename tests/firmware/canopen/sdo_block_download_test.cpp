#include "firmware/canopen/sdo_block_download.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/firmware/canopen/in_memory_objects.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"

namespace kmax::firmware::canopen::sdo_block_download_test {
namespace {

constexpr ObjectAddress domain = InMemoryObjects::domain;

struct SdoBlockDownloadTest : testing::Test {
  using Download = SdoBlockDownload<InMemoryObjects>;
  using Step = Download::Step;

  void begin(std::uint8_t block_size, bool crc = true) {
    ASSERT_EQ(sink.begin(domain, std::nullopt), Abort::none);
    download.begin(block_size, crc);
  }

  Step segment(std::uint8_t first, std::uint8_t content = 0) {
    return download.segment({first, content, content, content, content, content, content, content}, sink,
                            complete);
  }

  InMemoryObjects objects;
  std::array<std::uint8_t, 64> buffer{};
  SdoSink<InMemoryObjects> sink{objects, buffer};
  Download download;
  bool complete = false;
};

// In blocks of up to 31 segments every initiate is told from a segment; in longer ones it cannot be.
TEST_F(SdoBlockDownloadTest, WhatIsASegment) {
  begin(31);
  for (unsigned first = 0; first < 256; ++first) {
    const unsigned number = first & 0x7F;
    EXPECT_EQ(download.takes({static_cast<std::uint8_t>(first)}), number >= 1 && number <= 31) << first;
  }
  begin(127);
  EXPECT_TRUE(download.takes({0x40}));
  EXPECT_FALSE(download.takes({0x00}));
  EXPECT_FALSE(download.takes({0x80})) << "an abort is never a segment";
}

TEST_F(SdoBlockDownloadTest, BehindAGapNothingIsTakenUpToTheBlocksEnd) {
  begin(5);
  EXPECT_EQ(segment(1), Step::taken);
  EXPECT_EQ(segment(3), Step::lost);
  EXPECT_EQ(segment(1), Step::repeated);
  EXPECT_EQ(segment(4), Step::lost);
  EXPECT_FALSE(complete);
  EXPECT_EQ(segment(5), Step::lost);
  EXPECT_TRUE(complete);
  EXPECT_EQ(download.acknowledge(), (Eight{0xA2, 1, 5}));
  EXPECT_EQ(segment(1), Step::taken);
}

TEST_F(SdoBlockDownloadTest, ABlocksLastSegmentThatComesAgainIsNotAnsweredAgain) {
  begin(2);
  segment(1, 7);
  segment(2, 8);
  EXPECT_TRUE(complete);
  download.acknowledge();
  EXPECT_EQ(segment(2, 8), Step::repeated);
  EXPECT_FALSE(complete);
  EXPECT_EQ(segment(2, 9), Step::lost) << "another content: the one before is missing";
  EXPECT_TRUE(complete);
}

TEST_F(SdoBlockDownloadTest, LikewiseWhenItCameBehindAGap) {
  begin(5);
  segment(1, 7);
  segment(0x83, 8);
  EXPECT_TRUE(complete);
  EXPECT_EQ(download.acknowledge(), (Eight{0xA2, 1, 5}));
  EXPECT_EQ(segment(0x83, 8), Step::repeated);
  EXPECT_FALSE(complete);
}

TEST_F(SdoBlockDownloadTest, EqualSegmentsInBlocksOfOneAreNoRepetitions) {
  begin(1, false);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(segment(1, 0), Step::taken);
    EXPECT_TRUE(complete);
    download.acknowledge();
  }
  EXPECT_EQ(segment(0x81, 0), Step::taken);
  download.acknowledge();
  EXPECT_EQ(download.end({0xC1}, sink), Abort::none);
  EXPECT_EQ(objects.at(domain).value, Bytes(28, 0));
}

// A block that repeats the segment it was resumed with, contents and number alike, is a new segment.
TEST_F(SdoBlockDownloadTest, AnEqualFirstSegmentAfterAResumeIsTaken) {
  begin(5, false);
  segment(1, 0);
  segment(5, 0);
  EXPECT_EQ(download.acknowledge(), (Eight{0xA2, 1, 5}));
  EXPECT_EQ(segment(1, 0), Step::taken);
}

TEST_F(SdoBlockDownloadTest, TooMuchIsToldAtTheBlocksEnd) {
  begin(20);
  for (std::uint8_t number = 1; number <= 12; ++number) segment(number);
  EXPECT_FALSE(complete);
  EXPECT_EQ(download.failed(), Abort::memory) << "64 bytes are full";
  segment(20);
  EXPECT_TRUE(complete);
}

TEST_F(SdoBlockDownloadTest, OnlyABlockBegunAndOnlyWithCrcMayBeCut) {
  begin(5);
  EXPECT_FALSE(download.may_be_cut());
  segment(1);
  EXPECT_TRUE(download.may_be_cut());
  download.acknowledge();
  EXPECT_FALSE(download.may_be_cut());
  begin(5, false);
  segment(1);
  EXPECT_FALSE(download.may_be_cut());
}

TEST_F(SdoBlockDownloadTest, TheEndOutOfPlace) {
  begin(5);
  EXPECT_EQ(download.end({0xC1}, sink), Abort::command);
  segment(1);
  EXPECT_EQ(download.end({0xC1}, sink), Abort::command);
  EXPECT_TRUE(objects.writes.empty());
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_block_download_test
