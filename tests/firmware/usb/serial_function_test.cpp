#include "firmware/usb/serial_function.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/usb/fake_host.hpp"

namespace kmax::firmware::usb::serial_function_test {
namespace {

struct Bench : DeviceAtHost<> {
  Bench() : DeviceAtHost<>(fake_link) { host.enumerate(); }
  void send(const Bytes& reply) {
    functions.serial().send(reply);
    functions.ISR_serve();
  }
  bool sent() { return functions.serial().reply_sent(); }
  FakeLink fake_link;
};

Bytes counted(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i);
  return bytes;
}

TEST(UsbSerial, AReplyLeavesInPacketsWithAnEmptyOneBehindAFullLast) {
  for (const std::size_t size : {1U, 63U, 64U, 65U, 128U, 200U, 256U}) {
    Bench bench;
    const Bytes reply = counted(size);
    bench.send(reply);
    Bytes got;
    std::size_t last = full_packet;
    bool sent = false;
    while (last == full_packet) {
      EXPECT_EQ(bench.sent(), got == reply) << "the client has all of it before the empty packet";
      sent = got == reply;
      const Reply packet = bench.host.take(2);
      ASSERT_TRUE(packet) << size;
      last = packet->size();
      got.insert(got.end(), packet->begin(), packet->end());
    }
    EXPECT_EQ(got, reply);
    EXPECT_NE(bench.sent(), sent);
    EXPECT_FALSE(bench.host.take(2));
  }
}

TEST(UsbSerial, WithoutRoomTheHostWaits) {
  Bench bench;
  bench.fake_link.has_room = false;
  EXPECT_TRUE(bench.host.put(3, counted(64))) << "the one that was allowed before";
  EXPECT_FALSE(bench.host.put(3, counted(64)));
  bench.fake_link.has_room = true;
  bench.functions.ISR_serve();
  EXPECT_TRUE(bench.host.put(3, counted(5)));
  EXPECT_EQ(bench.fake_link.packets, (std::vector<Bytes>{counted(64), counted(5)}));
}

TEST(UsbSerial, WithoutAHostAReplyIsDoneAtOnce) {
  Bench bench;
  bench.host.reset();
  bench.send(counted(10));
  EXPECT_TRUE(bench.sent());
  bench.host.enumerate();
  EXPECT_FALSE(bench.host.take(2)) << "it was for another host";
}

TEST(UsbSerial, OpeningAndClosingThePortBeginsAnew) {
  Bench bench;
  const int before = bench.fake_link.restarts;
  const Bytes reply = counted(200);
  bench.send(reply);
  EXPECT_TRUE(bench.host.write({0x21, 0x22, 1, 1, 0}));
  EXPECT_EQ(bench.fake_link.restarts, before + 1);
  EXPECT_TRUE(bench.sent()) << "nobody waits for it any more";
  EXPECT_FALSE(bench.host.take(2)) << "nor gets the packet that was under way, whoever opens the port next";
  EXPECT_TRUE(bench.host.write({0x21, 0x22, 3, 1, 0}));
  EXPECT_EQ(bench.fake_link.restarts, before + 1) << "RTS means nothing";
  EXPECT_TRUE(bench.host.write({0x21, 0x22, 0, 1, 0}));
  EXPECT_EQ(bench.fake_link.restarts, before + 2);
  const Bytes next = counted(3);
  bench.send(next);
  EXPECT_EQ(bench.host.take(2), next);
}

TEST(UsbSerial, AClearedHaltCutsTheReplyThatWasUnderWay) {
  Bench bench;
  const Bytes reply = counted(200), next = counted(7);
  bench.send(reply);
  EXPECT_TRUE(bench.host.write({0x02, 3, 0, 0x82, 0}));
  EXPECT_FALSE(bench.host.take(2));
  EXPECT_TRUE(bench.host.write({0x02, 1, 0, 0x82, 0}));
  EXPECT_TRUE(bench.sent());
  bench.send(next);
  EXPECT_EQ(bench.host.take(2), next);
  EXPECT_EQ(bench.wire.broken_promises, 0);
}

}  // namespace
}  // namespace kmax::firmware::usb::serial_function_test
