#include "host_tools/device/can/socket_can.hpp"

#include <gtest/gtest.h>
#include <net/if.h>

#include <cstdlib>
#include <thread>

#include "host_tools/device/link.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::socket_can_test {

using drivers::CanFrame;
using host_tools_test::thrown_message;
using namespace std::chrono_literals;

CanFrame frame_with(std::uint32_t identifier, std::uint32_t number = 0) {
  CanFrame frame{.identifier = identifier, .length = 4};
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return frame;
}

// Runs on every machine: without CAN in the kernel that is what it says.
TEST(SocketCanOpening, SaysWhatIsMissing) {
  const auto message = thrown_message<LinkError>([] { SocketCan("vcan_none"); });
  EXPECT_CONTAINS(message, "vcan_none");
  const bool kernel_without_can = message.find("modprobe") != std::string::npos;
  if (!kernel_without_can) {
    EXPECT_CONTAINS(message, "there is no such interface");
    EXPECT_CONTAINS(message, "sudo ip link add dev vcan_none type vcan");
    EXPECT_CONTAINS(thrown_message<LinkError>([] { SocketCan("lo"); }), "not a CAN interface");
    EXPECT_CONTAINS(thrown_message<LinkError>([] { SocketCan("a_name_that_is_too_long_for_one"); }),
                    "there is no such interface");
  }
}

/// On the interface that KMAX_TEST_CAN names: a vcan, so that nothing real moves.
class SocketCanTest : public testing::Test {
 protected:
  void SetUp() override {
    const char* name = std::getenv("KMAX_TEST_CAN");
    if (name == nullptr || *name == '\0')
      GTEST_SKIP() << "KMAX_TEST_CAN names no interface (export KMAX_TEST_CAN=vcan0)";
    if (if_nametoindex(name) == 0)
      GTEST_SKIP() << "KMAX_TEST_CAN=" << name << ": there is no such interface here";
    interface = name;
  }
  std::string interface;
};

TEST_F(SocketCanTest, CarriesEveryKindOfFrame) {
  SocketCan a(interface), b(interface);
  CanFrame extended = frame_with(0x1ABCDEF0), remote = frame_with(0x705), empty = frame_with(0x80);
  extended.extended = true;
  remote.remote = true;
  empty.length = 0;
  for (const CanFrame& frame : {extended, remote, empty, frame_with(0x7FF, 99)}) {
    a.send(frame);
    const auto received = b.receive(1s);
    ASSERT_TRUE(received);
    EXPECT_EQ(received->frame, frame);
  }
  EXPECT_FALSE(a.receive(1ms)) << "own frames do not come back";
  EXPECT_EQ(a.counters().sent, 4u);
  EXPECT_EQ(b.counters().received, 4u);
  EXPECT_EQ(b.trouble(), "");
  EXPECT_FALSE(b.bus_off());
}

TEST_F(SocketCanTest, OnlyWhatItAskedForPasses) {
  CanPortOptions options{.filters = {{0x585, 0x7FF}, {0x700, 0x780}}};
  SocketCan a(interface), b(interface, options);
  CanFrame extended = frame_with(0x585), remote = frame_with(0x585);
  extended.extended = true;
  remote.remote = true;
  for (const CanFrame& frame : {frame_with(0x584), extended, remote, frame_with(0x585), frame_with(0x680),
                                frame_with(0x77F), frame_with(0x780)})
    a.send(frame);
  EXPECT_EQ(b.receive(1s).value().frame, frame_with(0x585));
  EXPECT_EQ(b.receive(1s).value().frame, frame_with(0x77F));
  EXPECT_FALSE(b.receive(10ms));
}

// The stamp says when the frame came in, however late it is fetched.
TEST_F(SocketCanTest, TheTimeIsTheKernels) {
  SocketCan a(interface), b(interface);
  const auto now = [] { return std::chrono::system_clock::now().time_since_epoch(); };
  const auto before = now();
  a.send(frame_with(1));
  const auto after = now();
  std::this_thread::sleep_for(50ms);
  const auto received = b.receive(0us);
  ASSERT_TRUE(received);
  EXPECT_GE(received->time, before);
  EXPECT_LE(received->time, after + 10ms);
}

TEST_F(SocketCanTest, FramesStayInOrderAndLostOnesAreCounted) {
  SocketCan a(interface), b(interface);
  constexpr std::uint32_t count = 20000;
  for (std::uint32_t i = 0; i < count; ++i) a.send(frame_with(0x123, i));
  std::uint32_t expected = 0, got = 0;
  while (const auto received = b.receive(0us)) {
    const auto& data = received->frame.data;
    const std::uint32_t number = data[0] | std::uint32_t{data[1]} << 8 | std::uint32_t{data[2]} << 16;
    EXPECT_GE(number, expected);
    expected = number + 1;
    ++got;
  }
  EXPECT_GE(got, 128u) << "a block of an SDO transfer must fit";
  a.send(frame_with(0x124));  // the count comes with the next frame
  ASSERT_TRUE(b.receive(1s));
  EXPECT_EQ(got + b.counters().lost, count);
}

TEST_F(SocketCanTest, WaitsAndWakes) {
  SocketCan a(interface), b(interface);
  const auto before = std::chrono::steady_clock::now();
  EXPECT_FALSE(b.receive(20ms));
  EXPECT_GE(std::chrono::steady_clock::now() - before, 20ms);
  std::thread later([&] {
    std::this_thread::sleep_for(20ms);
    a.send(frame_with(1));
  });
  EXPECT_TRUE(b.receive(10s));
  later.join();
}

TEST_F(SocketCanTest, ItsInterfaceIsListed) {
  const auto all = can_interfaces();
  EXPECT_TRUE(std::find(all.begin(), all.end(), interface) != all.end());
}

// Needs the right to set an interface up (root in a guest).
TEST_F(SocketCanTest, AnInterfaceThatGoesDownIsToldAndHowToBringItUp) {
  SocketCan port(interface);
  if (std::system(("ip link set " + interface + " down 2>/dev/null").c_str()) != 0)
    GTEST_SKIP() << "the interface cannot be set down here";
  const auto receiving = thrown_message<LinkError>([&] { port.receive(1s); });
  const auto sending = thrown_message<LinkError>([&] { port.send(frame_with(1)); });
  const auto opening = thrown_message<LinkError>([&] { SocketCan again(interface); });
  EXPECT_EQ(std::system(("ip link set " + interface + " up").c_str()), 0);
  for (const std::string& message : {receiving, sending, opening}) {
    EXPECT_CONTAINS(message, "is down");
    EXPECT_CONTAINS(message, "ip link set " + interface + " up");
  }
  SocketCan usable(interface);
  EXPECT_NO_THROW(usable.send(frame_with(1)));
}

}  // namespace kmax::device::socket_can_test
