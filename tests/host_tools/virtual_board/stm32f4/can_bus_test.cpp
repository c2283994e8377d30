// ISO 11898-1: frame formats, CRC sequence, bit stuffing; in whole frames: arbitration, acknowledgement,
// fault confinement, recessive bits.
#include "host_tools/virtual_board/stm32f4/can_bus.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string_view>
#include <vector>

#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/host_tools/virtual_board/stm32f4/random_can_frame.hpp"

namespace kmax::virtual_board::can_bus_test {

using drivers::CanFrame;
constexpr BoardTime bit = units_per_second / 500'000;

struct Bench {
  void run(BoardTime duration) {
    const BoardTime end = now + duration;
    for (BoardTime event = bus.next_event(); event <= end; event = bus.next_event()) {
      ASSERT_GE(event, now);
      now = event;
      bus.advance(now);
    }
    now = end;
  }
  BoardTime now = 5000;
  CanBus bus;
};

TEST(CanBus, FrameTakesItsBitsAndTheIntermission) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000};
  std::vector<BoardTime> received;
  b.on_frame([&](const CanFrame&, BoardTime at) { received.push_back(at); });
  const CanFrame frame{.identifier = 0x555, .length = 2, .data = {0x55, 0x55}};
  const BoardTime begin = bench.now;
  a.send(frame, bench.now);
  a.send(frame, bench.now);
  bench.run(1'000 * bit);
  const auto length = can_frame_bits(frame).bits.size();
  ASSERT_EQ(received.size(), 2U);
  EXPECT_EQ(received[0], begin + length * bit);
  EXPECT_EQ(received[1], begin + (2 * length + 3) * bit);
  EXPECT_EQ(bench.bus.busy_time(), 2 * (length + 3) * bit);
  EXPECT_EQ(a.sent(), 2U);
}

TEST(CanBus, LowestIdentifierWinsAndTheLosersHearIt) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000}, c{bench.bus, 500'000};
  std::vector<std::uint32_t> order;
  a.on_frame([&](const CanFrame& frame, BoardTime) { order.push_back(frame.identifier); });
  b.send({.identifier = 0x300}, bench.now);
  a.send({.identifier = 0x301}, bench.now);
  c.send({.identifier = 0x200}, bench.now);
  c.send({.identifier = 0x100}, bench.now);
  bench.run(1'000 * bit);
  EXPECT_EQ(order, (std::vector<std::uint32_t>{0x200, 0x100, 0x300}));
  EXPECT_EQ(b.lost_arbitrations(), 2U);
  EXPECT_EQ(a.lost_arbitrations(), 3U);
  EXPECT_EQ(a.errors().transmit_errors() + b.errors().transmit_errors(), 0U);
}

TEST(CanBus, AloneNobodyAcknowledgesAndTheNodeStaysErrorPassive) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000};
  a.send({.identifier = 1}, bench.now);
  bench.run(10'000 * bit);
  EXPECT_EQ(a.sent(), 0U);
  EXPECT_EQ(a.errors().transmit_errors(), 128U)
      << "an error passive node does not count a missing acknowledgement";
  CanHostNode listener{bench.bus, 500'000};
  listener.set_listen_only(true);
  bench.run(10'000 * bit);
  EXPECT_EQ(a.sent(), 0U) << "who only listens does not acknowledge";
  CanHostNode b{bench.bus, 500'000};
  bench.run(1'000 * bit);
  EXPECT_EQ(a.sent(), 1U);
  EXPECT_EQ(a.errors().transmit_errors(), 127U);
}

TEST(CanBus, DestroyedFramesCountForBothSidesAndEndInBusOff) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000};
  bench.bus.destroy_frames(31);
  a.send({.identifier = 1}, bench.now);
  bench.run(2'000 * bit);
  EXPECT_EQ(a.sent(), 1U);
  EXPECT_EQ(a.errors().transmit_errors(), 31U * 8 - 1);
  EXPECT_EQ(b.errors().receive_errors(), 30U);
  bench.bus.destroy_frames(100);
  a.send({.identifier = 1}, bench.now);
  bench.run(1'000 * bit);
  EXPECT_TRUE(a.errors().bus_off());
  EXPECT_EQ(bench.bus.frames_destroyed(), 31U + 2) << "247 + 2 times 8 is past 255";
  EXPECT_EQ(bench.bus.next_event(), never);
}

TEST(CanBus, WrongBitRateDestroysEverybodysFrames) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000}, wrong{bench.bus, 250'000};
  a.send({.identifier = 1}, bench.now);
  bench.run(3'000 * bit);
  EXPECT_EQ(a.sent(), 0U);
  EXPECT_TRUE(a.errors().bus_off());
  EXPECT_GT(wrong.errors().receive_errors(), 0U);
}

TEST(CanBus, SameIdentifierWithOtherDataIsACollision) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000}, c{bench.bus, 500'000};
  a.send({.identifier = 5, .length = 1, .data = {1}}, bench.now);
  b.send({.identifier = 5, .length = 1, .data = {2}}, bench.now);
  bench.run(40 * bit);
  EXPECT_EQ(a.errors().transmit_errors(), 8U);
  EXPECT_EQ(b.errors().transmit_errors(), 8U);
  Bench other;
  CanHostNode d{other.bus, 500'000}, e{other.bus, 500'000};
  d.send({.identifier = 5}, other.now);
  e.send({.identifier = 5}, other.now);
  other.run(100 * bit);
  EXPECT_EQ(d.sent() + e.sent(), 2U) << "equal frames are one and the same on the bus";
}

TEST(CanBus, BabblingNodeTakesTheWholeBus) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, babbler{bench.bus, 500'000};
  babbler.babble(CanFrame{.identifier = 0, .length = 8}, bench.now);
  bench.run(100 * bit);
  a.send({.identifier = 1}, bench.now);
  const BoardTime begin = bench.bus.busy_time();
  bench.run(100'000 * bit);
  EXPECT_EQ(a.sent(), 0U);
  EXPECT_GT(bench.bus.busy_time() - begin, 99'700 * bit);
  babbler.babble(std::nullopt, bench.now);
  bench.run(1'000 * bit);
  EXPECT_EQ(a.sent(), 1U);
}

TEST(CanBus, StuckLineStopsAllAndLetsGo) {
  Bench bench;
  CanHostNode a{bench.bus, 500'000}, b{bench.bus, 500'000};
  bench.bus.set_stuck_dominant(true, bench.now);
  a.send({.identifier = 1}, bench.now);
  bench.run(1'000 * bit);
  EXPECT_TRUE(bench.bus.busy());
  EXPECT_EQ(a.sent(), 0U);
  bench.bus.set_stuck_dominant(false, bench.now);
  bench.run(1'000 * bit);
  EXPECT_EQ(a.sent(), 1U);
}

TEST(RecessiveBits, IdleBusAndFramesBothCount) {
  RecessiveBits counter;
  counter.start(128, 10, false, 1000);
  EXPECT_EQ(counter.done_at(), 1000 + 128 * 110);
  counter.on_busy(1000 + 25 * 110 + 50);  // 25 whole sequences
  EXPECT_EQ(counter.done_at(), never);
  counter.on_idle(true, 10'000);  // one more
  EXPECT_EQ(counter.done_at(), 10'000 + 102 * 110);
  counter.on_busy(10'000);  // the next frame follows at once
  counter.on_idle(false, 20'000);
  EXPECT_EQ(counter.done_at(), 20'000 + 102 * 110);
}

TEST(RecessiveBits, EndsOnABusThatIsNeverIdle) {
  RecessiveBits counter;
  counter.start(128, 10, true, 0);
  BoardTime now = 0;
  unsigned frames = 0;
  while (counter.done_at() > now) {
    counter.on_idle(true, now += 1000);
    ++frames;
    counter.on_busy(now);
    ASSERT_LT(frames, 200U);
  }
  EXPECT_EQ(frames, 128U);
}

std::vector<bool> bits_of(std::string_view text) {
  std::vector<bool> bits;
  for (const char character : text) {
    for (int i = 7; i >= 0; --i) bits.push_back((character >> i & 1) != 0);
  }
  return bits;
}

// The check value that catalogues of CRCs give for CRC-15/CAN.
TEST(CanFrameBits, CrcOfTheCatalogue) {
  EXPECT_EQ(can_crc(bits_of("123456789")), 0x059E);
  EXPECT_EQ(can_crc({}), 0);
}

/// Without the stuff bits, up to the CRC delimiter.
std::vector<bool> unstuffed(const CanFrameBits& frame) {
  std::vector<bool> plain;
  unsigned equal = 0;
  bool last = true, skip = false;
  for (unsigned i = 0; i + 1 < frame.acknowledge_slot; ++i) {
    const bool sent = frame.bits[i];
    if (skip) {
      EXPECT_NE(sent, last) << "a stuff bit differs from the five before";
      skip = false;
      equal = 1;
      last = sent;
      continue;
    }
    plain.push_back(sent);
    equal = sent == last ? equal + 1 : 1;
    last = sent;
    if (equal == 5) skip = true;
  }
  return plain;
}

RC_GTEST_PROP(CanFrameBits, UnstuffsToAFrameWithAGoodCrc, ()) {
  const CanFrame frame = *testing::random_can_frame();
  const CanFrameBits bits = can_frame_bits(frame);
  const std::vector<bool> plain = unstuffed(bits);
  const unsigned data = frame.remote ? 0 : 8U * frame.length;
  RC_ASSERT(plain.size() == (frame.extended ? 54U : 34U) + data);
  // The remainder of a frame with its CRC is 0.
  RC_ASSERT(can_crc(plain) == 0);
  RC_ASSERT(bits.bits.size() == bits.acknowledge_slot + 9);
  for (unsigned i = bits.acknowledge_slot - 1; i < bits.bits.size(); ++i) RC_ASSERT(bits.bits[i]);
}

TEST(CanFrameBits, LengthsStayWithinTheKnownBounds) {
  // Worst case without intermission: 8 n + 44 + floor((34 + 8 n - 1) / 4) bits, extended 8 n + 64 + floor((54
  // + 8 n - 1) / 4).
  for (unsigned n = 0; n <= 8; ++n) {
    std::size_t longest = 0;
    for (unsigned pattern = 0; pattern < 256; ++pattern) {
      CanFrame frame{.identifier = 0x078, .length = static_cast<std::uint8_t>(n)};
      frame.data.fill(static_cast<std::uint8_t>(pattern));
      const std::size_t length = can_frame_bits(frame).bits.size();
      ASSERT_GE(length, 44 + 8 * n);
      ASSERT_LE(length, 44 + 8 * n + (33 + 8 * n) / 4);
      longest = std::max(longest, length);
    }
    EXPECT_GT(longest, 44 + 8 * n);
  }
}

// Identifier 0, no data: 00000 1 00000 1 0000 ... the very bits, written down by hand up to the data length
// code.
TEST(CanFrameBits, StuffBitsOfTheLowestIdentifier) {
  const std::vector<bool> bits = can_frame_bits({.identifier = 0}).bits;
  const std::string begin([&] {
    std::string text;
    for (unsigned i = 0; i < 22; ++i) text += bits[i] ? '1' : '0';
    return text;
  }());
  // 19 dominant bits (SOF, 11 of identifier, RTR, IDE, r0, 4 of DLC): a recessive one after each five.
  EXPECT_EQ(begin, "0000010000010000010000");
}

RC_GTEST_PROP(CanFrameBits, ArbitrationAgreesWithTheBits, ()) {
  const CanFrame a = *testing::random_can_frame(), b = *testing::random_can_frame();
  const std::uint32_t key_a = drivers::can_arbitration(a), key_b = drivers::can_arbitration(b);
  if (key_a == key_b) return;
  RC_ASSERT((key_a < key_b) == (can_frame_bits(a).bits < can_frame_bits(b).bits));
}

}  // namespace kmax::virtual_board::can_bus_test
