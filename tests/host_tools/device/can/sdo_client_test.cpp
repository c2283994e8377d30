// SdoClient's transfers in segments, and its block upload (CiA 301, 7.2.4.3.12 to 7.2.4.3.15).
#include "host_tools/device/can/sdo_client.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>

#include "firmware/canopen/sdo_server.hpp"
#include "host_tools/device/can/unix_can_hub.hpp"
#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::sdo_client_test {

using drivers::CanFrame;
using firmware::canopen::Abort;
using host_tools_test::FakeSdoNode;
using host_tools_test::frame_of;
using host_tools_test::patient_sdo;
using host_tools_test::quick_sdo;
using host_tools_test::SdoBench;
using host_tools_test::some_bytes;
using host_tools_test::thrown_message;
using Frames = FakeSdoNode::Frames;
using Bytes = SdoClient::Bytes;

constexpr SdoClient::Object object{0x2000, 4};
constexpr std::size_t largest = 49152;

FakeSdoNode::Misbehave loses(int first, int last = 0) {
  return [=](int number, const CanFrame& answer) {
    return first <= number && number <= std::max(first, last) ? Frames{} : Frames{answer};
  };
}
FakeSdoNode::Misbehave replaces(int which, const Frames& others) {
  return [=](int number, const CanFrame& answer) { return number == which ? others : Frames{answer}; };
}
CanFrame abort_with(Abort code) {
  const auto word = static_cast<std::uint32_t>(code);
  const auto byte = [&](int n) { return static_cast<std::uint8_t>(word >> (8 * n)); };
  return frame_of(0x585, {0x80, 0x00, 0x20, 0x04, byte(0), byte(1), byte(2), byte(3)});
}

TEST(SdoClient, EveryLength) {
  SdoBench bench;
  for (const std::size_t size :
       {1u, 2u, 3u, 4u, 0u, 5u, 6u, 7u, 8u, 14u, 15u, 100u, 888u, 889u, 890u, 2000u}) {
    bench.node.put(object, some_bytes(size));
    EXPECT_EQ(bench.client().upload(object), some_bytes(size)) << size << " bytes in segments";
    EXPECT_EQ(bench.client().upload(object, largest), some_bytes(size)) << size << " bytes in blocks";
    bench.node.put(object, {});
    bench.client().download(object, some_bytes(size), false);
    EXPECT_EQ(bench.node.get(object), some_bytes(size)) << size << " bytes written";
  }
  EXPECT_EQ(bench.client().counters().foreign, 0u);
  EXPECT_EQ(bench.client().counters().repeated, 0u);
  EXPECT_EQ(bench.client().counters().lost_segments, 0u);
  EXPECT_EQ(bench.client().counters().transfers, 3 * 16u);
  bench.client().upload({0x1000, 0});  // until the last message has arrived
  EXPECT_TRUE(bench.node.server().idle());
}

TEST(SdoClient, TheLargestBlockUploadIsShownBlockByBlock) {
  SdoBench bench;
  bench.node.put(object, some_bytes(largest));
  std::vector<std::size_t> shown;
  EXPECT_EQ(bench.client().upload(object, largest, [&](std::size_t bytes) { shown.push_back(bytes); }),
            some_bytes(largest));
  ASSERT_EQ(shown.size(), (largest + 888) / 889);
  EXPECT_EQ(shown[0], 889u);
  EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end()));
  bench.client().upload({0x1000, 0});  // until the last message has arrived
  // Initiate, start, one response for each block, end; and that question.
  EXPECT_EQ(bench.node.commands().size(), shown.size() + 3 + 1);
}

// The size and the checksum may be left out (CiA 301, 7.2.4.3.6); a node may have no blocks, or answer with
// the segmented protocol (protocol switch threshold).
TEST(SdoClient, NodesThatDoLess) {
  for (const auto& change : std::initializer_list<void (*)(host_tools_test::FakeSdoServer&)>{
           [](auto& server) { server.tells_size = false; }, [](auto& server) { server.has_crc = false; },
           [](auto& server) { server.has_blocks = false; },
           [](auto& server) { server.switches_to_segments = true; }}) {
    SdoBench bench;
    change(bench.node.server());
    for (const std::size_t size : {3u, 20u, 300u, 1000u}) {
      bench.node.put(object, some_bytes(size));
      EXPECT_EQ(bench.client().upload(object, 1000), some_bytes(size));
      EXPECT_TRUE(size <= 4 || bench.client().upload(object) == some_bytes(size));
    }
    EXPECT_EQ(bench.client().counters().repeated, 0u);
  }
  SdoBench bench;
  bench.node.server().tells_size = false;
  bench.node.put(object, {1, 2});
  EXPECT_EQ(bench.client().upload(object), (Bytes{1, 2, 0, 0})) << "all four bytes, then";
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

TEST(SdoClient, OnlyIdempotentWritesAreRepeated) {
  {
    SdoBench bench(loses(1), quick_sdo());
    bench.client().download(object, Bytes{7}, true);
    EXPECT_GE(bench.node.written().size(), 2u);
  }
  SdoBench bench(loses(1), quick_sdo());
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

TEST(SdoClient, ALostAnswerToASegmentOfAWriteEndsIt) {
  SdoBench bench(loses(3), quick_sdo());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().download(object, some_bytes(30), false); }),
                  "no answer from node 5");
  EXPECT_TRUE(bench.node.written().empty()) << "no object is written before the transfer is complete";
  bench.client().download(object, some_bytes(30), false);
  EXPECT_EQ(bench.node.get(object), some_bytes(30));
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

TEST(SdoClient, ARestartInMidTransferIsNoticedAtOnce) {
  SdoBench bench([](int number, const CanFrame& answer) {
    return number == 1 ? Frames{frame_of(0x705, {0})} : Frames{answer};
  });
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.client().download(object, Bytes{1}, false); }),
                  "restarted");
  EXPECT_EQ(bench.client().counters().timeouts, 0u);
}

struct Trouble {
  const char* name;
  std::size_t size;
  bool in_blocks;
  FakeSdoNode::Misbehave misbehave;
  const char* error = nullptr;  // nullptr: got over
  unsigned repeated = 0;        // transfers, exactly; of those that are got over
  unsigned least_lost = 0;      // segments of blocks
  bool once_more = false;       // may be repeated more often on a busy machine: an answer was lost
  bool has_crc = true;
};

// Of 2000 bytes in blocks 1 is the answer to the initiation, 2 the first of 286 segments (127, 127, 32), 128
// the first block's last one.
TEST(SdoClient, TroubleInMidTransferIsGotOverOrNamed) {
  const auto changed = [](auto change) {
    return [=](int number, CanFrame answer) {
      change(number, answer);
      return Frames{answer};
    };
  };
  const auto announced = [&](std::uint8_t size) {
    return changed([=](int, CanFrame& answer) {
      if (answer.data[0] == 0x41) answer.data[4] = size;
    });
  };
  const Frames closed{frame_of(FakeSdoNode::hang_up, {})};
  std::vector<CanFrame> held;
  std::vector<Trouble> troubles{
      {"a lost answer", 4, false, loses(1), nullptr, 1, 0, true},
      {"a segment that comes twice", 30, false,
       [](int number, const CanFrame& answer) {
         return number == 2 ? Frames{answer, answer} : Frames{answer};
       },
       nullptr, 1},
      {"a lost segment", 30, false, loses(3), nullptr, 1, 0, true},
      {"the node aborts", 30, false, replaces(3, {abort_with(Abort::device_state)}), "08000022"},
      // 0x0504xxxx and the toggle bit are about the transfer: the next attempt may do better.
      {"the node has timed out", 30, false, replaces(2, {abort_with(Abort::timeout)}), nullptr, 1},
      {"more than anybody can hold", 30, false, changed([](int, CanFrame& answer) {
         if (answer.data[0] == 0x41) std::fill_n(answer.data.begin() + 4, 4, std::uint8_t{0xFF});
       }),
       "4294967295 bytes"},
      {"more than announced", 30, false, announced(20), "announced"},
      {"less than announced", 30, false, announced(40), "announced"},
      {"the bus is closed at once", 30, false, replaces(1, closed), "the bus was closed"},
      {"the bus is closed", 30, false, replaces(3, closed), "the bus was closed"},
      {"the bus is closed in mid-block", 2000, true, replaces(60, closed), "closed"},
      {"the node is stopped", 30, false, [](int, const CanFrame&) { return Frames{frame_of(0x705, {4})}; },
       "the device is there, its state is stopped", 0, 0, true},
      {"the node aborts in mid-block", 2000, true,
       [](int number, const CanFrame& answer) {
         if (number < 50) return Frames{answer};
         return number == 50 ? Frames{abort_with(Abort::device_state)} : Frames{};
       },
       "08000022"},
      {"many lost segments of blocks", 5000, true,
       [](int number, const CanFrame& answer) { return number % 61 == 3 ? Frames{} : Frames{answer}; },
       nullptr, 0, 11},
      {"segments repeated and out of order", 2000, true,
       [&held](int number, const CanFrame& answer) {
         if (number == 20) return Frames{answer, answer};
         if (number == 40) held = {answer};
         return number == 40 ? Frames{} : number == 41 ? Frames{answer, held[0]} : Frames{answer};
       }},
      {"a flipped bit", 2000, true,
       changed([](int number, CanFrame& answer) { answer.data[4] ^= number == 100 ? 0x20 : 0; }), nullptr, 1},
      {"a checksum that is always wrong", 100, true, changed([](int, CanFrame& answer) {
         if ((answer.data[0] & 0xE3) == 0xC1 && (answer.data[0] & 0x80) != 0) answer.data[1] ^= 1;
       }),
       "checksum"},
      {"a whole block is lost", 2000, true, loses(129, 255), nullptr, 1, 0, true},
      {"the node's end is lost", 2000, true, loses(288), nullptr, 1, 0, true},
      {"the first answer is lost", 2000, true, loses(1), nullptr, 1, 0, true},
      {"less than announced in blocks", 101, true, changed([](int, CanFrame& answer) {
         if ((answer.data[0] & 0xF9) == 0xC0) answer.data[4] ^= 1;
       }),
       "announced", 0, 0, false, false},
      {"the first segment never comes", 100, true,
       [](int number, const CanFrame& answer) {
         return number > 1 && (answer.data[0] & 0x7F) == 1 ? Frames{} : Frames{answer};
       },
       "again and again", 0, 0, true},
  };
  for (const int lost : {2, 3, 70, 127, 128, 129, 200, 255, 256, 286, 287})
    troubles.push_back(
        {"a lost segment of a block is asked for again", 2000, true, loses(lost), nullptr, 0, 1});
  for (const Trouble& trouble : troubles) {
    SCOPED_TRACE(trouble.name);
    SdoBench bench(trouble.misbehave, trouble.once_more ? quick_sdo() : patient_sdo());
    bench.node.server().has_crc = trouble.has_crc;
    bench.node.put(object, some_bytes(trouble.size));
    const auto upload = [&] {
      return trouble.in_blocks ? bench.client().upload(object, std::min<std::size_t>(trouble.size, 5000))
                               : bench.client().upload(object);
    };
    if (trouble.error != nullptr) {
      EXPECT_CONTAINS(thrown_message<std::runtime_error>(upload), trouble.error);
      continue;
    }
    EXPECT_EQ(upload(), some_bytes(trouble.size));
    const auto& counters = bench.client().counters();
    EXPECT_TRUE(counters.repeated == trouble.repeated || (trouble.once_more && counters.repeated > 0))
        << counters.repeated;
    EXPECT_GE(counters.lost_segments, trouble.least_lost);
  }
}

// After an abort or a closed bus in mid-transfer the client is as good as the bus is.
TEST(SdoClient, WhatComesAfterATransferThatWasCutOff) {
  SdoBench aborted(replaces(3, {abort_with(Abort::device_state)}));
  aborted.node.put(object, some_bytes(30));
  thrown_message<SdoAborted>([&] { aborted.client().upload(object); });
  EXPECT_EQ(aborted.client().upload(object), some_bytes(30));
  SdoBench lost(loses(3), quick_sdo());
  lost.node.put(object, some_bytes(30));
  EXPECT_EQ(lost.client().upload(object), some_bytes(30));
  EXPECT_GE(lost.client().counters().timeouts, 1u);
  EXPECT_GE(lost.node.count(0x80), 1u) << "the open transfer is ended";
  SdoBench closed(replaces(3, {frame_of(FakeSdoNode::hang_up, {})}));
  closed.node.put(object, some_bytes(30));
  for (int attempt = 0; attempt < 2; ++attempt)
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { closed.client().upload(object); }), "closed");
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

TEST(SdoClient, AnAbortAtTheStartOfABlockUploadIsNotRepeated) {
  SdoBench bench;
  bench.node.refuse(object, Abort::device_state);
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { bench.client().upload(object, largest); }), "08000022");
  EXPECT_EQ(bench.node.commands().size(), 1u);
}

// Frames with the number 0 are no segments, and no sign of one to come.
TEST(SdoClient, FramesThatAreNoSegmentsDoNotPutOffTheEndOfWaiting) {
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

TEST(SdoClient, AnInterruptionEndsTheTransferInTheNode) {
  struct Interrupted {};
  SdoBench bench;
  bench.node.put(object, some_bytes(2000));
  EXPECT_THROW(bench.client().upload(object, 2000, [](std::size_t) { throw Interrupted{}; }), Interrupted);
  bench.node.put({0x2000, 5}, {1, 2});
  EXPECT_EQ(bench.client().upload({0x2000, 5}), (SdoClient::Bytes{1, 2}));
  EXPECT_TRUE(bench.node.server().idle());
  EXPECT_EQ(bench.client().upload(object, 2000), some_bytes(2000));
}

// --- Against the firmware's SDO server: two that were written apart.

using firmware::canopen::ObjectAddress;

constexpr ObjectAddress long_one{0x5822, 1}, number{0x2000, 4};

/// One object that keeps what is written, one number of four bytes.
struct Objects {
  std::vector<std::uint8_t> value, four = {1, 2, 3, 4};

  std::vector<std::uint8_t>* find(ObjectAddress address) {
    if (address == long_one) return &value;
    return address == number || address == ObjectAddress{0x1000, 0} ? &four : nullptr;
  }
  Abort read_begin(ObjectAddress address, std::uint32_t& size) {
    const auto* found = find(address);
    if (found == nullptr) return Abort::no_object;
    size = static_cast<std::uint32_t>(found->size());
    return Abort::none;
  }
  Abort read(ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out) {
    std::copy_n(find(address)->begin() + offset, out.size(), out.begin());
    return Abort::none;
  }
  Abort write_begin(ObjectAddress address, firmware::canopen::WriteBounds& bounds) {
    if (find(address) == nullptr) return Abort::no_object;
    bounds =
        address == number ? firmware::canopen::WriteBounds{4, 4} : firmware::canopen::WriteBounds{0, 2048};
    return Abort::none;
  }
  Abort write(ObjectAddress address, std::span<const std::uint8_t> in) {
    find(address)->assign(in.begin(), in.end());
    return Abort::none;
  }
};

/// The server on a bus of its own, in a thread. `loses` frames it sends, counted from 1.
class Node {
 public:
  explicit Node(std::function<bool(int)> loses = {}) : loses_(std::move(loses)) {
    server_.start(firmware::canopen::SdoChannel::predefined(5));
  }
  ~Node() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
  }
  SdoClient& client() {
    if (client_) return *client_;
    thread_ = std::thread([this] { serve(); });
    CanPortOptions options{.filters = SdoClient::filters_for(5)};
    port_ = open_can_port(hub_.path(), options);
    return client_.emplace(*port_, std::uint8_t{5}, loses_ ? quick_sdo() : patient_sdo());
  }
  Objects objects;

 private:
  static std::uint32_t now() {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                          std::chrono::steady_clock::now().time_since_epoch())
                                          .count());
  }
  void send_all() {
    CanFrame frame;
    while (server_.next_frame(frame, now())) {
      if (!loses_ || !loses_(++sent_)) hub_.send(frame);
    }
  }
  void serve() {
    while (!done_) {
      pollfd one{hub_.descriptor(), POLLIN, 0};
      poll(&one, 1, 20);
      for (const CanFrame& frame : hub_.poll()) {
        server_.receive(frame, now());
        send_all();
      }
      server_.poll(now());
      send_all();
    }
  }

  std::function<bool(int)> loses_;
  host_tools_test::TemporaryFolder folder_;
  UnixCanHub hub_{(folder_ / "bus").string()};
  firmware::canopen::SdoServer<Objects, 2048> server_{objects};
  std::unique_ptr<CanPort> port_;
  std::optional<SdoClient> client_;
  std::atomic<bool> done_ = false;
  int sent_ = 0;
  std::thread thread_;
};

constexpr std::size_t lengths[] = {1, 3, 4, 5, 6, 7, 8, 14, 100, 888, 889, 890, 2000, 2048};

TEST(SdoClientOnFirmware, EveryTransferOfEveryLength) {
  Node node;
  for (const std::size_t length : lengths) {
    const auto bytes = some_bytes(length);
    node.client().download(long_one, bytes, false);
    EXPECT_EQ(node.client().upload(long_one), bytes) << length << " bytes in segments";
    EXPECT_EQ(node.client().upload(long_one, 2048), bytes) << length << " bytes in blocks";
  }
  EXPECT_EQ(node.client().counters().repeated, 0u);
  EXPECT_EQ(node.client().counters().foreign, 0u);
}

TEST(SdoClientOnFirmware, TheLongestCapture) {
  Node node;
  node.objects.value = some_bytes(49152);
  EXPECT_EQ(node.client().upload(long_one, 49152), some_bytes(49152));
}

TEST(SdoClientOnFirmware, LostSegmentsOfBlocks) {
  Node node([](int sent) { return sent % 67 == 5; });
  node.objects.value = some_bytes(5000);
  EXPECT_EQ(node.client().upload(long_one, 5000), some_bytes(5000));
  EXPECT_GT(node.client().counters().lost_segments, 5u);
}

TEST(SdoClientOnFirmware, LostAnswers) {
  Node node([](int sent) { return sent == 1 || sent == 9; });
  node.objects.value = some_bytes(30);
  EXPECT_EQ(node.client().upload(long_one), some_bytes(30));
  EXPECT_EQ(node.client().upload(number), (SdoClient::Bytes{1, 2, 3, 4}));
  EXPECT_EQ(node.client().upload(long_one), some_bytes(30));
}

TEST(SdoClientOnFirmware, Aborts) {
  Node node;
  const std::uint8_t three[] = {1, 2, 3};
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { node.client().download(number, three, false); }), "short");
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] {
                    node.client().upload({0x2000, 5}, 100);
                  }),
                  "no such object");
  EXPECT_CONTAINS(
      thrown_message<SdoAborted>([&] { node.client().download(long_one, some_bytes(2049), false); }),
      "0607001");
  EXPECT_EQ(node.client().upload(number), (SdoClient::Bytes{1, 2, 3, 4}));
}

}  // namespace kmax::device::sdo_client_test
