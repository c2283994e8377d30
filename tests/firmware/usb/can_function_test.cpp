#include "firmware/usb/can_function.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/usb/fake_host.hpp"

namespace kmax::firmware::usb::can_function_test {
namespace {

using drivers::CanFrame;

Bytes words(std::initializer_list<std::uint32_t> all) {
  Bytes bytes(4 * all.size());
  std::size_t at = 0;
  for (const std::uint32_t word : all) gs::put_word(bytes, 4 * at++, word);
  return bytes;
}

struct Bench : DeviceAtHost<> {
  Bench() : DeviceAtHost<>(fake_link) { host.enumerate(); }
  bool set_mode(std::uint16_t channel, std::uint32_t mode, std::uint32_t flags = 0) {
    return host.write({0x41, 2, channel, 0, 8}, words({mode, flags}));
  }
  bool send(std::uint32_t echo, const CanFrame& frame, std::uint8_t channel = 0) {
    gs::HostFrame out;
    out.echo = echo;
    out.channel = channel;
    out.frame = frame;
    const auto bytes = gs::encoded(out);
    return host.put(2, Bytes(bytes.begin(), bytes.end()));
  }
  /// What the main loop does with what comes.
  int take_all() {
    gs::HostFrame frame;
    int taken = 0;
    for (; functions.can().next_from_host(frame); ++taken) functions.can().done(frame);
    functions.ISR_serve();
    return taken;
  }
  std::optional<gs::HostFrame> receive() {
    const Reply bytes = host.take(1);
    if (!bytes) return std::nullopt;
    EXPECT_EQ(bytes->size(), gs::frame_bytes);
    return gs::decoded(*bytes);
  }
  void show(const CanFrame& frame, CanChannel channel = CanChannel::node) {
    functions.can().show(channel, frame);
    functions.ISR_serve();
  }
  FakeLink fake_link;
};

const CanFrame some_frame{.identifier = 0x601, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};

TEST(UsbCan, TheLayoutOfAFrameIsThatOfGsUsb) {
  gs::HostFrame frame;
  frame.echo = 0x0403'0201;
  frame.channel = 1;
  frame.frame = {.identifier = 0x1ABC'DEF0, .extended = true, .length = 2, .data = {0xAA, 0xBB}};
  const auto bytes = gs::encoded(frame);
  EXPECT_EQ(Bytes(bytes.begin(), bytes.end()),
            (Bytes{1, 2, 3, 4, 0xF0, 0xDE, 0xBC, 0x9A, 2, 1, 0, 0, 0xAA, 0xBB, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(gs::decoded(bytes).frame, frame.frame);
  const CanFrame remote{.identifier = 0x7FF, .remote = true, .length = 8};
  frame.frame = remote;
  EXPECT_EQ(gs::decoded(gs::encoded(frame)).frame, remote);
}

TEST(UsbCan, AnswersADriversFirstQuestions) {
  Bench bench;
  EXPECT_TRUE(bench.host.write({0x41, 0, 1, 0, 4}, words({0x0000'BEEF})));
  EXPECT_FALSE(bench.host.write({0x41, 0, 1, 0, 4}, words({0xEFBE'0000})))
      << "a host of the other byte order";
  EXPECT_EQ(bench.host.read({0xC1, 4, 0, 0, 40}), words({0, 42'000'000, 1, 16, 1, 8, 4, 1, 1024, 1}));
}

TEST(UsbCan, TakesABitTimingThatTheBusCouldHaveAndNoOther) {
  Bench bench;
  const auto set = [&bench](const Bytes& timing) { return bench.host.write({0x41, 1, 0, 0, 20}, timing); };
  EXPECT_TRUE(set(words({7, 8, 5, 1, 2})));
  EXPECT_TRUE(set(words({0, 1, 1, 1, 1024})));
  EXPECT_FALSE(set(words({9, 8, 5, 1, 2})));
  EXPECT_FALSE(set(words({7, 8, 9, 1, 2})));
  EXPECT_FALSE(set(words({7, 8, 5, 5, 2})));
  EXPECT_FALSE(set(words({7, 8, 5, 1, 0})));
  EXPECT_FALSE(set(words({0xFFFF'FFFF, 2, 5, 1, 2}))) << "a sum that wraps";
  EXPECT_FALSE(bench.host.write({0x41, 1, 2, 0, 20}, words({7, 8, 5, 1, 2}))) << "no such channel";
}

TEST(UsbCan, OpensAndClosesEachChannelByItself) {
  Bench bench;
  auto& can = bench.functions.can();
  EXPECT_FALSE(can.is_open(CanChannel::node));
  EXPECT_TRUE(bench.set_mode(0, 1));
  EXPECT_TRUE(can.is_open(CanChannel::node));
  EXPECT_FALSE(can.is_open(CanChannel::bus));
  EXPECT_TRUE(bench.set_mode(1, 1));
  EXPECT_TRUE(bench.set_mode(0, 0));
  EXPECT_FALSE(can.is_open(CanChannel::node));
  EXPECT_TRUE(can.is_open(CanChannel::bus));
  EXPECT_FALSE(bench.set_mode(0, 1, 1)) << "listen-only is none of its features";
  EXPECT_FALSE(bench.set_mode(0, 2));
  bench.host.reset();
  EXPECT_FALSE(can.is_open(CanChannel::bus));
}

TEST(UsbCan, AFrameComesBackAsItsEchoWhenItIsDone) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  EXPECT_TRUE(bench.send(5, some_frame));
  EXPECT_FALSE(bench.receive()) << "the main loop has not had it";
  EXPECT_EQ(bench.take_all(), 1);
  const auto echo = bench.receive();
  ASSERT_TRUE(echo);
  EXPECT_EQ(echo->echo, 5U);
  EXPECT_EQ(echo->frame, some_frame);
  EXPECT_FALSE(bench.receive());
}

TEST(UsbCan, WhatTheNodeSendsIsSeenAsReceived) {
  Bench bench;
  bench.show(some_frame);
  ASSERT_TRUE(bench.set_mode(0, 1));
  EXPECT_FALSE(bench.receive()) << "from before it was open";
  bench.show(some_frame);
  bench.show(some_frame, CanChannel::bus);
  const auto seen = bench.receive();
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->echo, gs::no_echo);
  EXPECT_EQ(seen->channel, 0);
  EXPECT_EQ(seen->frame, some_frame);
  EXPECT_FALSE(bench.receive()) << "channel 1 is closed";
}

TEST(UsbCan, AHostThatDoesNotReadLosesFramesAndIsToldAndStillHasItsEchoes) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  for (int i = 0; i < 100; ++i) bench.show(some_frame);
  int sent = 0;
  while (sent < 100 && bench.send(static_cast<std::uint32_t>(sent), some_frame)) ++sent;
  EXPECT_GE(sent, 8);
  EXPECT_LT(sent, 100) << "it waits";
  int echoes = 0, seen = 0;
  bench.take_all();
  while (const auto frame = bench.receive()) {
    bench.take_all();
    (frame->echo == gs::no_echo ? seen : echoes) += 1;
  }
  EXPECT_EQ(echoes, sent);
  EXPECT_LT(seen, 100);
  bench.show(some_frame);
  EXPECT_EQ(bench.receive()->flags, gs::flag_overflow);
  bench.show(some_frame);
  EXPECT_EQ(bench.receive()->flags, 0);
  EXPECT_TRUE(bench.send(1, some_frame)) << "and goes on";
  EXPECT_EQ(bench.wire.broken_promises, 0);
}

TEST(UsbCan, WhatIsNoFrameOrForAClosedChannelIsNothing) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  EXPECT_TRUE(bench.host.put(2, Bytes(19)));
  EXPECT_TRUE(bench.host.put(2, {}));
  EXPECT_TRUE(bench.send(1, {.identifier = 1, .length = 9}));
  EXPECT_TRUE(bench.send(1, {.identifier = 0x800, .length = 1}));
  EXPECT_TRUE(bench.send(1, {.identifier = gs::id_error | 1, .extended = true, .length = 1}));
  EXPECT_TRUE(bench.send(1, some_frame, 1));
  EXPECT_TRUE(bench.send(1, some_frame, 7));
  EXPECT_EQ(bench.take_all(), 0);
  EXPECT_TRUE(bench.send(2, some_frame));
  EXPECT_EQ(bench.take_all(), 1);
}

TEST(UsbCan, AClosedChannelKeepsNothingForWhoOpensItNext) {
  for (const bool other_open : {true, false}) {
    for (const bool closes : {true, false}) {
      Bench bench;
      ASSERT_TRUE(bench.set_mode(1, 1));
      if (other_open) {
        ASSERT_TRUE(bench.set_mode(0, 1));
      }
      const gs::HostFrame waits = bench.functions.can().to_host(CanChannel::bus, some_frame);
      for (int i = 0; i < 100; ++i) bench.show(some_frame, CanChannel::bus);
      EXPECT_TRUE(bench.send(1, some_frame, 1));
      if (closes) {
        EXPECT_TRUE(bench.set_mode(1, 0));
      }
      EXPECT_TRUE(bench.set_mode(1, 1));
      bench.functions.can().show_of_others(waits);
      EXPECT_EQ(bench.take_all(), 1);
      EXPECT_FALSE(bench.receive()) << "neither frames nor the echo, and not the one in the endpoint";
      bench.show(some_frame, CanChannel::bus);
      EXPECT_EQ(bench.receive()->flags, 0) << "nor the loss";
      EXPECT_EQ(bench.wire.broken_promises, 0);
    }
  }
}

TEST(UsbCan, ClosingAChannelLeavesTheOtherAsItWas) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  ASSERT_TRUE(bench.set_mode(1, 1));
  for (int i = 0; i < 3; ++i) {
    bench.show(some_frame);
    bench.show(some_frame, CanChannel::bus);
  }
  EXPECT_TRUE(bench.send(4, some_frame));
  EXPECT_TRUE(bench.set_mode(1, 0));
  bench.take_all();
  int seen = 0, echoes = 0;
  while (const auto frame = bench.receive()) {
    EXPECT_EQ(frame->channel, 0);
    (frame->echo == gs::no_echo ? seen : echoes) += 1;
  }
  EXPECT_EQ(seen, 3);
  EXPECT_EQ(echoes, 1);
}

TEST(UsbCan, WhatOthersSayOnTheBusDoesNotKeepOutWhatTheNodeSays) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  ASSERT_TRUE(bench.set_mode(1, 1));
  auto& can = bench.functions.can();
  for (int i = 0; i < 100; ++i) can.show_of_others(can.to_host(CanChannel::bus, some_frame));
  EXPECT_EQ(can.counters().lost, 60U) << "40 wait for a PC that does not read: docs/usb.md, block uploads";
  int said = 0;
  for (; can.has_room(); ++said) bench.show(some_frame);
  EXPECT_GT(said, 8);
  int of_node = 0;
  while (const auto frame = bench.receive()) of_node += frame->channel == 0 ? 1 : 0;
  EXPECT_EQ(of_node, said);
}

TEST(UsbCan, CountsWhatDidNotGoThrough) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  EXPECT_TRUE(bench.host.put(2, Bytes(19)));
  EXPECT_TRUE(bench.send(1, some_frame, 1)) << "closed";
  EXPECT_TRUE(bench.send(1, {.identifier = 0x800, .length = 1}));
  EXPECT_EQ(bench.functions.can().counters().refused, 3U);
  EXPECT_EQ(bench.functions.can().counters().lost, 0U);
  for (int i = 0; i < 100; ++i) bench.show(some_frame);
  EXPECT_EQ(bench.functions.can().counters().lost, 43U) << "57 fit: one is in the endpoint";
}

TEST(UsbCan, WhatWaitsFromBeforeAResetIsNobodys) {
  Bench bench;
  ASSERT_TRUE(bench.set_mode(0, 1));
  EXPECT_TRUE(bench.send(1, some_frame));
  bench.show(some_frame);
  bench.host.enumerate();
  ASSERT_TRUE(bench.set_mode(0, 1));
  gs::HostFrame frame;
  ASSERT_TRUE(bench.functions.can().next_from_host(frame));
  EXPECT_FALSE(bench.functions.can().is_current(frame));
  bench.functions.can().done(frame);
  bench.functions.ISR_serve();
  EXPECT_FALSE(bench.receive());
}

}  // namespace
}  // namespace kmax::firmware::usb::can_function_test
