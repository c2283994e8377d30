// SdoClient's block upload (CiA 301, 7.2.4.3.12 to 7.2.4.3.15).
#include <gtest/gtest.h>

#include "host_tools/device/can/sdo_client.hpp"
#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::sdo_block_upload_test {
namespace {
using drivers::CanFrame;
using firmware::canopen::Abort;
using host_tools_test::FakeSdoNode;
using host_tools_test::frame_of;
using host_tools_test::quick_sdo;
using host_tools_test::SdoBench;
using host_tools_test::some_bytes;
using host_tools_test::thrown_message;
using Frames = FakeSdoNode::Frames;

constexpr SdoClient::Object object{0x5821, 1};
constexpr std::size_t largest = 49152;

TEST(SdoBlockUpload, EveryLength) {
  SdoBench bench;
  for (const std::size_t size : {0u, 1u, 6u, 7u, 8u, 100u, 888u, 889u, 890u, 2000u, 49152u}) {
    bench.node.put(object, some_bytes(size));
    EXPECT_EQ(bench.client().upload(object, largest), some_bytes(size)) << size << " bytes";
  }
  EXPECT_EQ(bench.client().counters().repeated, 0u);
  EXPECT_EQ(bench.client().counters().lost_segments, 0u);
  EXPECT_EQ(bench.client().counters().foreign, 0u);
  bench.client().upload({0x1000, 0});  // until the last message has arrived
  EXPECT_TRUE(bench.node.server().idle());
}

TEST(SdoBlockUpload, TheLargestIsToldBlockByBlock) {
  SdoBench bench;
  bench.node.put(object, some_bytes(largest));
  std::vector<std::size_t> told;
  EXPECT_EQ(bench.client().upload(object, largest, [&](std::size_t bytes) { told.push_back(bytes); }),
            some_bytes(largest));
  ASSERT_EQ(told.size(), (largest + 888) / 889);
  EXPECT_EQ(told[0], 889u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  bench.client().upload({0x1000, 0});  // until the last message has arrived
  // Initiate, start, one response for each block, end; and that question.
  EXPECT_EQ(bench.node.commands().size(), told.size() + 3 + 1);
}

TEST(SdoBlockUpload, WithoutCrcOrSize) {
  for (const bool crc : {false, true}) {
    SdoBench bench;
    bench.node.server().has_crc = crc;
    bench.node.server().tells_size = !crc;
    bench.node.put(object, some_bytes(1000));
    EXPECT_EQ(bench.client().upload(object, 1000), some_bytes(1000));
  }
}

TEST(SdoBlockUpload, ANodeWithoutBlocksIsReadInSegments) {
  SdoBench bench;
  bench.node.server().has_blocks = false;
  bench.node.put(object, some_bytes(300));
  EXPECT_EQ(bench.client().upload(object, 300), some_bytes(300));
}

// The node may answer with the segmented protocol (protocol switch threshold).
TEST(SdoBlockUpload, ANodeThatSwitchesToSegmentsIsFollowed) {
  SdoBench bench;
  bench.node.server().switches_to_segments = true;
  for (const std::size_t size : {3u, 300u}) {
    bench.node.put(object, some_bytes(size));
    EXPECT_EQ(bench.client().upload(object, 300), some_bytes(size));
  }
  EXPECT_EQ(bench.client().counters().repeated, 0u);
}

TEST(SdoBlockUpload, AnAbortAtTheStart) {
  SdoBench bench;
  bench.node.refuse(object, Abort::device_state);
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { bench.client().upload(object, largest); }), "08000022");
  EXPECT_EQ(bench.node.commands().size(), 1u);
}

TEST(SdoBlockUpload, AnAbortInMidBlock) {
  SdoBench bench([](int number, const CanFrame& answer) {
    if (number < 50) return Frames{answer};
    return number == 50 ? Frames{frame_of(0x585, {0x80, 0x21, 0x58, 0x01, 0x22, 0, 0, 8})} : Frames{};
  });
  bench.node.put(object, some_bytes(2000));
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { bench.client().upload(object, 2000); }), "08000022");
}

/// 1 is the answer to the initiation, 2 the first segment, 128 the first block's last one.
class LostSegment : public testing::TestWithParam<int> {};

TEST_P(LostSegment, IsAskedForAgain) {
  SdoBench bench(
      [](int number, const CanFrame& answer) { return number == GetParam() ? Frames{} : Frames{answer}; });
  bench.node.put(object, some_bytes(2000));  // 286 segments: 127, 127, 32
  EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000));
  EXPECT_GE(bench.client().counters().lost_segments, 1u);
  EXPECT_EQ(bench.client().counters().repeated, 0u) << "the transfer goes on";
}

INSTANTIATE_TEST_SUITE_P(First, LostSegment,
                         testing::Values(2, 3, 70, 127, 128, 129, 200, 255, 256, 286, 287));

TEST(SdoBlockUpload, ManyLostSegments) {
  SdoBench bench(
      [](int number, const CanFrame& answer) { return number % 61 == 3 ? Frames{} : Frames{answer}; });
  bench.node.put(object, some_bytes(5000));
  EXPECT_EQ(bench.client().upload(object, 5000), some_bytes(5000));
  EXPECT_GT(bench.client().counters().lost_segments, 10u);
  EXPECT_EQ(bench.client().counters().repeated, 0u);
}

TEST(SdoBlockUpload, ARepeatedOrReorderedSegmentDoesNoHarm) {
  std::vector<CanFrame> held;
  SdoBench bench([&](int number, const CanFrame& answer) {
    if (number == 20) return Frames{answer, answer};
    if (number == 40) {
      held = {answer};
      return Frames{};
    }
    return number == 41 ? Frames{answer, held[0]} : Frames{answer};
  });
  bench.node.put(object, some_bytes(2000));
  EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000));
}

TEST(SdoBlockUpload, AFlippedBitIsFoundByTheChecksumAndReadAgain) {
  SdoBench bench([](int number, CanFrame answer) {
    if (number == 100) answer.data[4] ^= 0x20;
    return Frames{answer};
  });
  bench.node.put(object, some_bytes(2000));
  EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000));
  EXPECT_EQ(bench.client().counters().repeated, 1u);
}

TEST(SdoBlockUpload, AChecksumThatIsAlwaysWrongIsTold) {
  SdoBench bench([](int, CanFrame answer) {
    if ((answer.data[0] & 0xE3) == 0xC1 && (answer.data[0] & 0x80) != 0) answer.data[1] ^= 1;
    return Frames{answer};
  });
  bench.node.put(object, some_bytes(100));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object, 100); }), "checksum");
}

// A whole block is lost, or the node's end, or its first answer: the transfer begins anew.
TEST(SdoBlockUpload, WhatCannotBeResumedBeginsAnew) {
  for (const auto& [first, last] : {std::pair{129, 255}, std::pair{288, 288}, std::pair{1, 1}}) {
    SdoBench bench(
        [first = first, last = last](int number, const CanFrame& answer) {
          return first <= number && number <= last ? Frames{} : Frames{answer};
        },
        quick_sdo());
    bench.node.put(object, some_bytes(2000));
    EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000)) << first;
    EXPECT_GE(bench.client().counters().repeated, 1u) << first;
  }
}

TEST(SdoBlockUpload, LessThanAnnouncedIsNotTaken) {
  SdoBench bench([](int, CanFrame answer) {
    if ((answer.data[0] & 0xF9) == 0xC0) answer.data[4] ^= 1;
    return Frames{answer};
  });
  bench.node.server().has_crc = false;
  bench.node.put(object, some_bytes(101));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object, 100); }), "announced");
}

TEST(SdoBlockUpload, ABusThatIsClosedInMidBlock) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 60 ? Frames{frame_of(FakeSdoNode::hang_up, {})} : Frames{answer};
  });
  bench.node.put(object, some_bytes(2000));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object, 2000); }), "closed");
}

TEST(SdoBlockUpload, ANodeThatNeverSendsTheFirstSegmentIsGivenUp) {
  SdoBench silent_first(
      [](int count, const CanFrame& answer) {
        return count > 1 && (answer.data[0] & 0x7F) == 1 ? Frames{} : Frames{answer};
      },
      quick_sdo());
  silent_first.node.put(object, some_bytes(100));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { silent_first.client().upload(object, 100); }),
                  "again and again");
}

// Frames with the number 0 are no segments, and no sign of one to come.
TEST(SdoBlockUpload, FramesThatAreNoSegmentsDoNotPutOffTheEndOfWaiting) {
  SdoSettings settings = quick_sdo();
  settings.attempts = 1;
  SdoBench bench(
      [](int number, CanFrame answer) {
        if (number == 1) return Frames{answer};
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        answer.data[0] = 0;
        return Frames{answer};
      },
      settings);
  bench.node.put(object, some_bytes(700));  // 100 segments: 1 s
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object, 700); }), "no answer");
  EXPECT_LT(bench.client().counters().foreign, 100u);
}

TEST(SdoBlockUpload, AnInterruptionEndsTheTransferInTheNode) {
  struct Interrupted {};
  SdoBench bench;
  bench.node.put(object, some_bytes(2000));
  EXPECT_THROW(bench.client().upload(object, 2000, [](std::size_t) { throw Interrupted{}; }), Interrupted);
  bench.node.put({0x2000, 4}, {1, 2});
  EXPECT_EQ(bench.client().upload({0x2000, 4}), (SdoClient::Bytes{1, 2}));
  EXPECT_TRUE(bench.node.server().idle());
  EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000));
}

}  // namespace
}  // namespace kmax::link::sdo_block_upload_test
