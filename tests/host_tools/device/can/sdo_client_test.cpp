#include "host_tools/device/can/sdo_client.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::sdo_client_test {
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
using Bytes = SdoClient::Bytes;

constexpr SdoClient::Object object{0x2000, 4};

TEST(SdoClient, UploadsEveryLength) {
  SdoBench bench;
  for (const std::size_t size : {1u, 2u, 3u, 4u, 0u, 5u, 7u, 8u, 14u, 15u, 890u}) {
    bench.node.put(object, some_bytes(size));
    EXPECT_EQ(bench.client().upload(object), some_bytes(size)) << size << " bytes";
  }
  EXPECT_EQ(bench.client().counters().foreign, 0u);
  EXPECT_EQ(bench.client().counters().repeated, 0u);
  EXPECT_EQ(bench.client().counters().transfers, 11u);
}

// CiA 301, 7.2.4.3.6: the size may be left out.
TEST(SdoClient, UploadsWithoutAnAnnouncedSize) {
  SdoBench bench;
  bench.node.server().tells_size = false;
  bench.node.put(object, {1, 2});
  EXPECT_EQ(bench.client().upload(object), (Bytes{1, 2, 0, 0}));
  bench.node.put(object, some_bytes(20));
  EXPECT_EQ(bench.client().upload(object), some_bytes(20));
}

TEST(SdoClient, DownloadsEveryLength) {
  SdoBench bench;
  for (const std::size_t size : {1u, 2u, 3u, 4u, 0u, 5u, 7u, 8u, 14u, 15u, 890u}) {
    bench.client().download(object, some_bytes(size), false);
    EXPECT_EQ(bench.node.get(object), some_bytes(size)) << size << " bytes";
  }
}

TEST(SdoClient, AnAbortIsNotRepeatedAndSaysWhy) {
  SdoBench bench;
  bench.node.refuse(object, Abort::value_too_high);
  for (const bool writing : {false, true}) {
    try {
      writing ? bench.client().download(object, Bytes{1}, true) : void(bench.client().upload(object));
      FAIL();
    } catch (const SdoAborted& aborted) {
      EXPECT_EQ(aborted.code(), Abort::value_too_high);
      EXPECT_EQ(aborted.object(), object);
      EXPECT_CONTAINS(aborted.what(), "0x2000:04");
      EXPECT_CONTAINS(aborted.what(), "above the highest");
      EXPECT_CONTAINS(aborted.what(), "06090031");
    }
  }
  EXPECT_EQ(bench.node.commands().size(), 2u);
}

TEST(SdoClient, AnUnknownAbortCodeIsShownInFull) {
  SdoBench bench;
  bench.node.refuse(object, static_cast<Abort>(0x12345678));
  const auto message = thrown_message<SdoAborted>([&] { bench.client().upload(object); });
  EXPECT_CONTAINS(message, "12345678");
}

/// Loses the first answer of the transfers of `object`, not those to markers.
Frames lose_first(int number, const CanFrame& answer) {
  return number == 1 ? Frames{} : Frames{answer};
}

TEST(SdoClient, AReadSurvivesALostAnswer) {
  SdoBench bench(lose_first, quick_sdo());
  bench.node.put(object, {1, 2, 3, 4});
  EXPECT_EQ(bench.client().upload(object), (Bytes{1, 2, 3, 4}));
  EXPECT_GE(bench.client().counters().timeouts, 1u);
  EXPECT_GE(bench.client().counters().repeated, 1u);
}

TEST(SdoClient, OnlyIdempotentWritesAreRepeated) {
  {
    SdoBench bench(lose_first, quick_sdo());
    bench.client().download(object, Bytes{7}, true);
    EXPECT_GE(bench.node.written().size(), 2u);
  }
  SdoBench bench(lose_first, quick_sdo());
  const auto message = thrown_message<LinkError>([&] { bench.client().download(object, Bytes{7}, false); });
  EXPECT_CONTAINS(message, "sent once");
  EXPECT_EQ(bench.node.written().size(), 1u);
  bench.node.put(object, {9});
  EXPECT_EQ(bench.client().upload(object), Bytes{9});
}

// The answer to the first attempt comes only after the second question, and the value has changed meanwhile:
// the old one must not be taken for the new one, nor for the answer to a later question.
TEST(SdoClient, ALateAnswerIsNotTakenForTheNext) {
  std::vector<CanFrame> late;
  SdoBench bench(
      [&late](int number, const CanFrame& answer) {
        if (number == 1) {
          late.push_back(answer);
          return Frames{};
        }
        if (number == 2) return Frames{late[0], answer};  // before the marker's answer
        return Frames{answer};
      },
      quick_sdo());
  bench.node.put(object, {1});
  const SdoClient::Object other{0x2000, 5};
  bench.node.put(other, {2});
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().download(object, Bytes{3}, false); }),
                  "once");
  // The same object, and the late answer is one to a download: a read must not end in it.
  EXPECT_EQ(bench.client().upload(object), Bytes{3});
  EXPECT_GE(bench.client().counters().foreign, 1u);
}

TEST(SdoClient, AStaleReadOfTheSameObjectIsDropped) {
  std::vector<CanFrame> late;
  FakeSdoNode* node = nullptr;
  SdoBench bench(
      [&](int number, const CanFrame& answer) {
        if (number == 1) {
          late.push_back(answer);
          node->put(object, {2});
          return Frames{};
        }
        if (number == 2) return Frames{late[0], answer};
        return Frames{answer};
      },
      quick_sdo());
  node = &bench.node;
  bench.node.put(object, {1});
  EXPECT_EQ(bench.client().upload(object), Bytes{2}) << "the value at the time of the last question";
}

// Somebody else was answered about the very object that is asked for next.
TEST(SdoClient, WhatCameWhileNobodyAskedIsDropped) {
  SdoBench bench([](int number, const CanFrame& answer) {
    if (number != 1) return Frames{answer};
    return Frames{answer, frame_of(0x585, {0x4F, 0x00, 0x20, 0x05, 99, 0, 0, 0})};
  });
  const SdoClient::Object next{0x2000, 5};
  bench.node.put(object, {1});
  bench.node.put(next, {2});
  EXPECT_EQ(bench.client().upload(object), Bytes{1});
  pollfd arrived{bench.port->descriptor(), POLLIN, 0};
  ASSERT_EQ(poll(&arrived, 1, 10'000), 1);
  EXPECT_EQ(bench.client().upload(next), Bytes{2});
}

TEST(SdoClient, AnswersThatAreNotItsOwnAreSkipped) {
  SdoBench bench([](int, const CanFrame& answer) {
    CanFrame other_object = answer, short_one = answer, remote = answer, extended = answer, node_6 = answer;
    other_object.data[3] ^= 1;
    short_one.length = 7;
    remote.remote = true;
    extended.extended = true;
    node_6.identifier = 0x586;
    auto other_abort = frame_of(0x585, {0x80, 0x01, 0x20, 0x04, 0, 0, 4, 5});
    return Frames{other_object, short_one, remote, extended, node_6, other_abort, answer};
  });
  bench.node.put(object, {1, 2, 3, 4});
  EXPECT_EQ(bench.client().upload(object), (Bytes{1, 2, 3, 4}));
  bench.client().download(object, Bytes{5}, false);
  EXPECT_EQ(bench.node.get(object), Bytes{5});
  EXPECT_EQ(bench.client().counters().timeouts, 0u);
}

TEST(SdoClient, ASegmentThatComesTwiceBeginsTheReadAnew) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 2 ? Frames{answer, answer} : Frames{answer};
  });
  bench.node.put(object, some_bytes(30));
  EXPECT_EQ(bench.client().upload(object), some_bytes(30));
  EXPECT_EQ(bench.client().counters().repeated, 1u);
}

TEST(SdoClient, ALostSegmentBeginsTheReadAnew) {
  SdoBench bench([](int number, const CanFrame& answer) { return number == 3 ? Frames{} : Frames{answer}; },
                 quick_sdo());
  bench.node.put(object, some_bytes(30));
  EXPECT_EQ(bench.client().upload(object), some_bytes(30));
  EXPECT_GE(bench.client().counters().timeouts, 1u);
  EXPECT_GE(bench.node.count(0x80), 1u) << "the open transfer is ended";
}

TEST(SdoClient, ALostAnswerToASegmentOfAWriteEndsIt) {
  SdoBench bench([](int number, const CanFrame& answer) { return number == 3 ? Frames{} : Frames{answer}; },
                 quick_sdo());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().download(object, some_bytes(30), false); }),
                  "no answer from node 5");
  EXPECT_TRUE(bench.node.written().empty()) << "no object is written before the transfer is complete";
  bench.client().download(object, some_bytes(30), false);
  EXPECT_EQ(bench.node.get(object), some_bytes(30));
}

TEST(SdoClient, AnAbortInMidTransferIsTheNodes) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 3 ? Frames{frame_of(0x585, {0x80, 0x00, 0x20, 0x04, 0x22, 0, 0, 8})} : Frames{answer};
  });
  bench.node.put(object, some_bytes(30));
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { bench.client().upload(object); }), "08000022");
  EXPECT_EQ(bench.client().upload(object), some_bytes(30));
}

// 0x0504xxxx and the toggle bit are about the transfer: the next attempt may do better.
TEST(SdoClient, ATransferTheNodeTimedOutIsRepeated) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 2 ? Frames{frame_of(0x585, {0x80, 0x00, 0x20, 0x04, 0, 0, 4, 5})} : Frames{answer};
  });
  bench.node.put(object, some_bytes(30));
  EXPECT_EQ(bench.client().upload(object), some_bytes(30));
}

TEST(SdoClient, ASilentNodeIsNamedWithWhatToCheck) {
  SdoBench bench([](int, const CanFrame&) { return Frames{}; }, quick_sdo());
  const auto message = thrown_message<LinkError>([&] { bench.client().upload(object); });
  EXPECT_CONTAINS(message, bench.node.path());
  EXPECT_CONTAINS(message, "no answer from node 5 within 500 ms");
  EXPECT_CONTAINS(message, "0x2000:04");
  EXPECT_CONTAINS(message, "sent 3 times");
  EXPECT_CONTAINS(message, "check that the device is powered");
  EXPECT_CONTAINS(message, "stopped by an NMT master");
}

TEST(SdoClient, AStoppedNodeIsTold) {
  SdoBench bench([](int, const CanFrame&) { return Frames{frame_of(0x705, {4})}; }, quick_sdo());
  const auto message = thrown_message<LinkError>([&] { bench.client().upload(object); });
  EXPECT_CONTAINS(message, "the device is there, its state is stopped");
}

TEST(SdoClient, ARestartInMidTransferIsNoticedAtOnce) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 1 ? Frames{frame_of(0x705, {0})} : Frames{answer};
  });
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().download(object, Bytes{1}, false); }),
                  "restarted");
  EXPECT_EQ(bench.client().counters().timeouts, 0u);
}

TEST(SdoClient, ANodeThatOnlyChattersIsGivenUp) {
  SdoBench bench(
      [](int, const CanFrame&) {
        return Frames(40, frame_of(0x585, {0x43, 0x34, 0x12, 0, 0, 0, 0, 0}));
      },
      quick_sdo());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object); }), "no answer");
  EXPECT_GE(bench.client().counters().foreign, 40u);
}

TEST(SdoClient, ABusThatIsClosedInMidTransferEndsItAtOnce) {
  for (const int last : {1, 3}) {
    SdoBench bench([last](int number, const CanFrame& answer) {
      return number == last ? Frames{frame_of(FakeSdoNode::hang_up, {})} : Frames{answer};
    });
    bench.node.put(object, some_bytes(30));
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object); }), "the bus was closed");
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object); }), "closed");
  }
}

TEST(SdoClient, ANodeThatAnnouncesTooMuchIsGivenUp) {
  SdoBench bench([](int, const CanFrame& answer) {
    if (answer.data[0] != 0x41) return Frames{answer};
    return Frames{frame_of(0x585, {0x41, 0x00, 0x20, 0x04, 0xFF, 0xFF, 0xFF, 0xFF})};
  });
  bench.node.put(object, some_bytes(30));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object); }), "4294967295 bytes");
}

TEST(SdoClient, MoreOrLessThanAnnouncedIsNotTaken) {
  for (const std::uint8_t announced : {std::uint8_t{20}, std::uint8_t{40}}) {
    SdoBench bench([announced](int, CanFrame answer) {
      if (answer.data[0] == 0x41) answer.data[4] = announced;
      return Frames{answer};
    });
    bench.node.put(object, some_bytes(30));
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().upload(object); }), "announced");
  }
}

}  // namespace
}  // namespace kmax::link::sdo_client_test
