#include "host_tools/device/can/unix_can_hub.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <filesystem>

#include "host_tools/device/can/unix_can.hpp"
#include "host_tools/device/link.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::unix_can_hub_test {
namespace {
using drivers::CanFrame;
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using namespace std::chrono_literals;

CanFrame numbered(std::uint32_t number) {
  CanFrame frame;
  frame.identifier = number & 0x7FF;
  frame.length = 4;
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return frame;
}

std::size_t open_descriptors() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

/// A client that is no UnixCan and sends what it likes.
FileDescriptor raw_client(const std::string& path) {
  FileDescriptor client(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  EXPECT_EQ(connect(client.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return client;
}

struct Bus {
  TemporaryFolder folder;
  std::string path = (folder / "bus").string();
  UnixCanHub hub{path};
};

TEST(UnixCanHub, AFrameReachesAllButItsSender) {
  Bus bus;
  UnixCan a(bus.path), b(bus.path), c(bus.path);
  a.send(numbered(1));
  const auto at_owner = bus.hub.poll();
  ASSERT_EQ(at_owner.size(), 1u);
  EXPECT_EQ(at_owner[0], numbered(1));
  EXPECT_EQ(bus.hub.clients(), 3u);
  for (UnixCan* one : {&b, &c}) {
    const auto received = one->receive(0us);
    ASSERT_TRUE(received);
    EXPECT_EQ(received->frame, numbered(1));
    EXPECT_FALSE(one->receive(0us));
  }
  EXPECT_FALSE(a.receive(0us));
  bus.hub.send(numbered(2));
  for (UnixCan* one : {&a, &b, &c}) EXPECT_EQ(one->receive(0us).value().frame, numbered(2));
  EXPECT_TRUE(bus.hub.poll().empty());
}

TEST(UnixCanHub, FramesOfOneClientStayInOrder) {
  Bus bus;
  UnixCan a(bus.path), b(bus.path);
  std::uint32_t sent = 0, at_owner = 0, at_b = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 50; ++i) a.send(numbered(sent++));
    for (;;) {
      const auto frames = bus.hub.poll();
      if (frames.empty()) break;
      EXPECT_LE(frames.size(), static_cast<std::size_t>(UnixCanHub::frames_per_client));
      for (const auto& frame : frames) ASSERT_EQ(frame, numbered(at_owner++));
    }
    while (const auto received = b.receive(0us)) ASSERT_EQ(received->frame, numbered(at_b++));
  }
  EXPECT_EQ(at_owner, sent);
  EXPECT_EQ(at_b, sent);
  EXPECT_EQ(bus.hub.counters().lost, 0u);
}

TEST(UnixCanHub, AFloodOfOneClientKeepsOutNobody) {
  Bus bus;
  UnixCan flooding(bus.path), quiet(bus.path);
  for (std::uint32_t i = 0; i < 100; ++i) flooding.send(numbered(i));
  quiet.send(numbered(0x700));
  const auto frames = bus.hub.poll();
  EXPECT_TRUE(std::find(frames.begin(), frames.end(), numbered(0x700)) != frames.end());
}

TEST(UnixCanHub, AClientThatDoesNotReadLosesFramesAndTheOthersDoNot) {
  Bus bus;
  UnixCan sleeping(bus.path), awake(bus.path);
  bus.hub.poll();
  constexpr std::uint32_t count = 50'000;  // more than the 4 MiB that are asked for hold
  for (std::uint32_t i = 0; i < count; ++i) {
    bus.hub.send(numbered(i));
    ASSERT_EQ(awake.receive(0us).value().frame, numbered(i));
  }
  EXPECT_GT(bus.hub.counters().lost, 0u);
  std::uint32_t got = 0;
  while (sleeping.receive(0us)) ++got;
  EXPECT_EQ(got + bus.hub.counters().lost, count);
  // A block of an SDO transfer must fit.
  EXPECT_GE(got, 128u);
}

TEST(UnixCanHub, ClientsComeAndGo) {
  Bus bus;
  const auto before = open_descriptors();
  for (int i = 0; i < 50; ++i) {
    UnixCan a(bus.path);
    a.send(numbered(7));
    ASSERT_EQ(bus.hub.poll().size(), 1u);
    ASSERT_EQ(bus.hub.clients(), 1u);
  }
  bus.hub.poll();
  EXPECT_EQ(bus.hub.clients(), 0u);
  EXPECT_EQ(open_descriptors(), before);
}

TEST(UnixCanHub, TheLastWordsOfAClientAreHeard) {
  Bus bus;
  { UnixCan(bus.path).send(numbered(9)); }
  EXPECT_EQ(bus.hub.poll().size(), 1u);
}

TEST(UnixCanHub, ItsDescriptorTellsThatThereIsSomethingToDo) {
  Bus bus;
  const auto readable = [&] {
    pollfd one{bus.hub.descriptor(), POLLIN, 0};
    return poll(&one, 1, 0) == 1;
  };
  EXPECT_FALSE(readable());
  UnixCan a(bus.path);
  EXPECT_TRUE(readable());
  bus.hub.poll();
  EXPECT_FALSE(readable());
  a.send(numbered(1));
  EXPECT_TRUE(readable());
  bus.hub.poll();
  EXPECT_FALSE(readable());
}

TEST(UnixCanHub, WhatIsNoFrameIsCountedAndDropped) {
  Bus bus;
  UnixCan good(bus.path);
  const FileDescriptor raw = raw_client(bus.path);
  const std::array<std::uint8_t, 40> bytes{0, 8, 0, 0, 8};  // also: an identifier of more than 11 bits
  for (const std::size_t length : {1u, 15u, 16u, 17u, 40u})
    ASSERT_EQ(::send(raw.number(), bytes.data(), length, 0), static_cast<ssize_t>(length));
  EXPECT_TRUE(bus.hub.poll().empty());
  EXPECT_EQ(bus.hub.counters().malformed, 5u);
  EXPECT_FALSE(good.receive(0us));
  good.send(numbered(1));
  EXPECT_EQ(bus.hub.poll().size(), 1u);
}

TEST(UnixCanHub, ASecondOneAtTheSamePathIsRefused) {
  Bus bus;
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub second(bus.path); }), "another program serves");
  UnixCan client(bus.path);  // and the first one is still there
  client.send(numbered(1));
  EXPECT_EQ(bus.hub.poll().size(), 1u);
}

TEST(UnixCanHub, WhatACrashedProgramLeftIsReplaced) {
  const TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  {
    const FileDescriptor abandoned(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), address.sun_path);
    ASSERT_EQ(bind(abandoned.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  EXPECT_TRUE(std::filesystem::exists(path));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan client(path); }),
                  "nobody serves this bus any more");
  {
    UnixCanHub hub(path);
    EXPECT_NO_THROW(UnixCan client(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path)) << "it is removed at the end";
}

TEST(UnixCanHub, AnotherThingAtThePathIsLeftAlone) {
  const TemporaryFolder folder;
  const auto file = folder.write("bus", "precious");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub(file.string()); }), "not a socket");
  EXPECT_EQ(folder.read("bus"), "precious");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub((folder / "no/such/bus").string()); }),
                  "cannot make a socket");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub("/tmp/" + std::string(120, 'x')); }), "107");
}

TEST(UnixCanHub, TheSocketOfASuccessorIsNotRemoved) {
  const TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  auto first = std::make_unique<UnixCanHub>(path);
  std::filesystem::rename(path, folder / "moved");
  const UnixCanHub second(path);
  first.reset();
  EXPECT_TRUE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace kmax::link::unix_can_hub_test
