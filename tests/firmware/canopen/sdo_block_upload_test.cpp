#include "firmware/canopen/sdo_block_upload.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/firmware/canopen/in_memory_objects.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"

namespace kmax::firmware::canopen::sdo_block_upload_test {
namespace {

constexpr ObjectAddress domain = InMemoryObjects::domain;

struct SdoBlockUploadTest : testing::Test {
  void begin(std::size_t size, std::uint8_t block_size) {
    objects.at(domain).value = pattern(size);
    ASSERT_EQ(source.begin(domain), Abort::none);
    upload.begin(block_size, true);
    EXPECT_FALSE(upload.has_segment()) << "before the client's go-ahead";
    ASSERT_EQ(upload.start(), Abort::none);
  }

  Eight next() {
    Eight bytes{};
    bytes.fill(0xEE);
    EXPECT_TRUE(upload.has_segment());
    EXPECT_EQ(upload.segment(source, bytes), Abort::none);
    return bytes;
  }

  InMemoryObjects objects;
  std::array<std::uint8_t, 112> window{};
  SdoSource<InMemoryObjects> source{objects, window};
  SdoBlockUpload<InMemoryObjects> upload;
  bool ended = false;
};

TEST_F(SdoBlockUploadTest, TheLastSegmentIsMarkedAndPaddedWithZeros) {
  begin(9, 127);
  const Bytes value = pattern(9);
  EXPECT_EQ(next()[0], 1);
  EXPECT_EQ(next(), (Eight{0x82, value[7], value[8]}));
  EXPECT_FALSE(upload.has_segment());
  EXPECT_EQ(upload.acknowledge(2, 0, ended), Abort::none);
  EXPECT_TRUE(ended);
  EXPECT_TRUE(upload.ending());
  EXPECT_EQ(upload.end_request()[0], 0xC1 | 5 << 2);
}

TEST_F(SdoBlockUploadTest, ABlockEndsAtItsSizeAndTheNextBeginsBehindTheLastGoodSegment) {
  begin(100, 3);
  const Bytes value = pattern(100);
  for (int i = 0; i < 3; ++i) next();
  EXPECT_FALSE(upload.has_segment());
  EXPECT_TRUE(upload.lost(1));
  EXPECT_FALSE(upload.lost(3));
  EXPECT_EQ(upload.acknowledge(1, 5, ended), Abort::none);
  EXPECT_FALSE(ended);
  const Eight resumed = next();
  EXPECT_EQ(resumed[0], 1);
  EXPECT_EQ(resumed[1], value[7]);
  for (int i = 0; i < 4; ++i) next();
  EXPECT_FALSE(upload.has_segment());
}

TEST_F(SdoBlockUploadTest, TheLastSegmentLostIsSentAgain) {
  begin(14, 127);
  next();
  const Eight last = next();
  EXPECT_EQ(upload.acknowledge(1, 127, ended), Abort::none);
  EXPECT_FALSE(ended);
  Eight again = next();
  EXPECT_EQ(again[0], 0x81);
  again[0] = last[0];
  EXPECT_EQ(again, last);
}

TEST_F(SdoBlockUploadTest, OutOfPlace) {
  EXPECT_EQ(upload.acknowledge(0, 1, ended), Abort::command) << "before the start";
  begin(100, 3);
  EXPECT_EQ(upload.start(), Abort::command) << "twice";
  next();
  EXPECT_EQ(upload.acknowledge(2, 3, ended), Abort::sequence);
  EXPECT_EQ(upload.acknowledge(1, 0, ended), Abort::block_size);
  EXPECT_EQ(upload.acknowledge(1, 128, ended), Abort::block_size);
  EXPECT_FALSE(upload.ending());
  begin(7, 3);
  next();
  EXPECT_EQ(upload.acknowledge(1, 3, ended), Abort::none);
  EXPECT_EQ(upload.acknowledge(1, 3, ended), Abort::command) << "after the end";
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_block_upload_test
