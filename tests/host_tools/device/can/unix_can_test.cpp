#include "host_tools/device/can/unix_can.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <thread>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "host_tools/device/link.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::unix_can_test {
namespace {
using drivers::CanFrame;
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using namespace std::chrono_literals;

CanFrame frame_with(std::uint32_t identifier) {
  CanFrame frame;
  frame.identifier = identifier;
  frame.length = 8;
  return frame;
}

struct Bus {
  TemporaryFolder folder;
  std::string path = (folder / "bus").string();
  std::optional<UnixCanHub> hub{path};
};

TEST(UnixCan, CarriesEveryKindOfFrame) {
  Bus bus;
  UnixCan port(bus.path);
  CanFrame extended = frame_with(0x1ABCDEF0);
  extended.extended = true;
  CanFrame remote = frame_with(0x705);
  remote.remote = true;
  remote.length = 1;
  CanFrame empty = frame_with(0x80);
  empty.length = 0;
  for (const CanFrame& frame : {extended, remote, empty, frame_with(0x7FF)}) {
    port.send(frame);
    ASSERT_EQ(bus.hub->poll().at(0), frame);
    bus.hub->send(frame);
    ASSERT_EQ(port.receive(0us).value().frame, frame);
  }
  EXPECT_EQ(port.counters().sent, 4u);
  EXPECT_EQ(port.counters().received, 4u);
  EXPECT_EQ(port.description(), bus.path);
}

TEST(UnixCan, OnlyWhatItAskedForPasses) {
  Bus bus;
  CanPortOptions options;
  options.filters = {{0x585, 0x7FF}, {0x700, 0x780}};
  UnixCan port(bus.path, options);
  bus.hub->poll();
  CanFrame extended = frame_with(0x585), remote = frame_with(0x585);
  extended.extended = true;
  remote.remote = true;
  for (const CanFrame& frame : {frame_with(0x584), extended, remote, frame_with(0x585), frame_with(0x680),
                                frame_with(0x77F), frame_with(0x780)})
    bus.hub->send(frame);
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(0x585));
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(0x77F));
  EXPECT_FALSE(port.receive(0us));
}

TEST(UnixCan, WaitsAsLongAsItIsToldAndNotMuchLonger) {
  Bus bus;
  UnixCan port(bus.path);
  const auto before = std::chrono::steady_clock::now();
  EXPECT_FALSE(port.receive(20ms));
  EXPECT_GE(std::chrono::steady_clock::now() - before, 20ms);
}

TEST(UnixCan, FramesForOthersDoNotHoldIt) {
  Bus bus;
  CanPortOptions options;
  options.filters = {{0x585, 0x7FF}};
  UnixCan port(bus.path, options);
  bus.hub->poll();
  std::atomic<bool> done = false;
  std::thread chatter([&] {
    while (!done) {
      bus.hub->send(frame_with(0x123));
      std::this_thread::sleep_for(100us);
    }
  });
  EXPECT_FALSE(port.receive(30ms));
  done = true;
  chatter.join();
}

TEST(UnixCan, WakesForAFrame) {
  Bus bus;
  UnixCan port(bus.path);
  bus.hub->poll();
  std::thread later([&] {
    std::this_thread::sleep_for(20ms);
    bus.hub->send(frame_with(1));
  });
  const auto received = port.receive(10s);
  later.join();
  ASSERT_TRUE(received);
  const auto age = std::chrono::system_clock::now().time_since_epoch() - received->time;
  EXPECT_GE(age, 0s);
  EXPECT_LT(age, 10s);
}

TEST(UnixCan, ABusThatIsClosedIsToldAtOnce) {
  Bus bus;
  UnixCan port(bus.path);
  bus.hub->poll();
  bus.hub->send(frame_with(3));
  bus.hub.reset();
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(3)) << "what was sent before is not lost";
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { port.receive(10s); }), "the bus was closed");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { port.send(frame_with(1)); }), "the bus was closed");
}

TEST(UnixCan, ABusThatTakesNothingIsGivenUpAfterAWhile) {
  Bus bus;
  CanPortOptions options;
  options.send_patience = 20ms;
  UnixCan port(bus.path, options);
  const auto message = thrown_message<LinkError>([&] {
    for (int i = 0; i < 100000; ++i) port.send(frame_with(1));
  });
  EXPECT_CONTAINS(message, "took no frame for 20 ms");
  EXPECT_EQ(port.counters().send_waits, 1u);
  EXPECT_GE(port.counters().sent, 128u);
}

TEST(UnixCan, WhatIsNoBusIsNamed) {
  const TemporaryFolder folder;
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan((folder / "none").string()); }),
                  "kmax serve --can");
  const auto file = folder.write("file", "");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan(file.string()); }), file.string());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan("/tmp/" + std::string(200, 'x')); }), "107");
}

}  // namespace
}  // namespace kmax::link::unix_can_test
