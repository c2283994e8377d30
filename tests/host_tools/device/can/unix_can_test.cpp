#include "host_tools/device/can/unix_can.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "host_tools/device/link.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::unix_can_test {

using drivers::CanFrame;
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using namespace std::chrono_literals;

CanFrame frame_with(std::uint32_t identifier) {
  return CanFrame{.identifier = identifier, .length = 8};
}

class UnixCanTest : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::string path = (folder / "bus").string();
  std::optional<UnixCanHub> hub{path};
};
using UnixCanHubTest = UnixCanTest;

TEST_F(UnixCanTest, CarriesEveryKindOfFrame) {
  UnixCan port(path);
  CanFrame extended = frame_with(0x1ABCDEF0);
  extended.extended = true;
  CanFrame remote = frame_with(0x705);
  remote.remote = true;
  remote.length = 1;
  CanFrame empty = frame_with(0x80);
  empty.length = 0;
  for (const CanFrame& frame : {extended, remote, empty, frame_with(0x7FF)}) {
    port.send(frame);
    ASSERT_EQ(hub->poll().at(0), frame);
    hub->send(frame);
    ASSERT_EQ(port.receive(0us).value().frame, frame);
  }
  EXPECT_EQ(port.counters().sent, 4u);
  EXPECT_EQ(port.counters().received, 4u);
  EXPECT_EQ(port.description(), path);
}

TEST_F(UnixCanTest, OnlyWhatItAskedForPasses) {
  CanPortOptions options{.filters = {{0x585, 0x7FF}, {0x700, 0x780}}};
  UnixCan port(path, options);
  hub->poll();
  CanFrame extended = frame_with(0x585), remote = frame_with(0x585);
  extended.extended = true;
  remote.remote = true;
  for (const CanFrame& frame : {frame_with(0x584), extended, remote, frame_with(0x585), frame_with(0x680),
                                frame_with(0x77F), frame_with(0x780)})
    hub->send(frame);
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(0x585));
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(0x77F));
  EXPECT_FALSE(port.receive(0us));
}

TEST_F(UnixCanTest, WaitsAsLongAsItIsToldAndNotMuchLonger) {
  UnixCan port(path);
  const auto before = std::chrono::steady_clock::now();
  EXPECT_FALSE(port.receive(20ms));
  EXPECT_GE(std::chrono::steady_clock::now() - before, 20ms);
}

TEST_F(UnixCanTest, FramesForOthersDoNotHoldIt) {
  CanPortOptions options{.filters = {{0x585, 0x7FF}}};
  UnixCan port(path, options);
  hub->poll();
  std::atomic<bool> done = false;
  std::thread chatter([&] {
    while (!done) {
      hub->send(frame_with(0x123));
      std::this_thread::sleep_for(100us);
    }
  });
  EXPECT_FALSE(port.receive(30ms));
  done = true;
  chatter.join();
}

TEST_F(UnixCanTest, WakesForAFrame) {
  UnixCan port(path);
  hub->poll();
  std::thread later([&] {
    std::this_thread::sleep_for(20ms);
    hub->send(frame_with(1));
  });
  const auto received = port.receive(10s);
  later.join();
  ASSERT_TRUE(received);
  const auto age = std::chrono::system_clock::now().time_since_epoch() - received->time;
  EXPECT_GE(age, 0s);
  EXPECT_LT(age, 10s);
}

TEST_F(UnixCanTest, ABusThatIsClosedIsToldAtOnce) {
  UnixCan port(path);
  hub->poll();
  hub->send(frame_with(3));
  hub.reset();
  EXPECT_EQ(port.receive(0us).value().frame, frame_with(3)) << "what was sent before is not lost";
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { port.receive(10s); }), "the bus was closed");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { port.send(frame_with(1)); }), "the bus was closed");
}

TEST_F(UnixCanTest, ABusThatTakesNothingIsGivenUpAfterAWhile) {
  CanPortOptions options{.send_patience = 20ms};
  UnixCan port(path, options);
  const auto message = thrown_message<LinkError>([&] {
    for (int i = 0; i < 100000; ++i) port.send(frame_with(1));
  });
  EXPECT_CONTAINS(message, "took no frame for 20 ms");
  EXPECT_EQ(port.counters().send_waits, 1u);
  EXPECT_GE(port.counters().sent, 128u);
}

TEST(UnixCanAlone, WhatIsNoBusIsNamed) {
  const TemporaryFolder folder;
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan((folder / "none").string()); }),
                  "kmax serve --can");
  const auto file = folder.write("file", "");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan(file.string()); }), file.string());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCan("/tmp/" + std::string(200, 'x')); }), "107");
}

CanFrame numbered(std::uint32_t number) {
  CanFrame frame{.identifier = number & 0x7FF, .length = 4};
  for (unsigned i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return frame;
}

std::size_t open_descriptors() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

/// A client that is no UnixCan and sends what it likes.
base::FileDescriptor raw_client(const std::string& path) {
  base::FileDescriptor client(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  EXPECT_EQ(connect(client.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return client;
}

TEST_F(UnixCanHubTest, AFrameReachesAllButItsSender) {
  UnixCan a(path), b(path), c(path);
  a.send(numbered(1));
  const auto at_owner = hub->poll();
  ASSERT_EQ(at_owner.size(), 1u);
  EXPECT_EQ(at_owner[0], numbered(1));
  EXPECT_EQ(hub->clients(), 3u);
  for (UnixCan* one : {&b, &c}) {
    const auto received = one->receive(0us);
    ASSERT_TRUE(received);
    EXPECT_EQ(received->frame, numbered(1));
    EXPECT_FALSE(one->receive(0us));
  }
  EXPECT_FALSE(a.receive(0us));
  hub->send(numbered(2));
  for (UnixCan* one : {&a, &b, &c}) EXPECT_EQ(one->receive(0us).value().frame, numbered(2));
  EXPECT_TRUE(hub->poll().empty());
}

TEST_F(UnixCanHubTest, FramesOfOneClientStayInOrder) {
  UnixCan a(path), b(path);
  std::uint32_t sent = 0, at_owner = 0, at_b = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 50; ++i) a.send(numbered(sent++));
    for (;;) {
      const auto frames = hub->poll();
      if (frames.empty()) break;
      EXPECT_LE(frames.size(), static_cast<std::size_t>(UnixCanHub::frames_per_client));
      for (const auto& frame : frames) ASSERT_EQ(frame, numbered(at_owner++));
    }
    while (const auto received = b.receive(0us)) ASSERT_EQ(received->frame, numbered(at_b++));
  }
  EXPECT_EQ(at_owner, sent);
  EXPECT_EQ(at_b, sent);
  EXPECT_EQ(hub->counters().lost, 0u);
}

TEST_F(UnixCanHubTest, AFloodOfOneClientKeepsOutNobody) {
  UnixCan flooding(path), quiet(path);
  for (std::uint32_t i = 0; i < 100; ++i) flooding.send(numbered(i));
  quiet.send(numbered(0x700));
  const auto frames = hub->poll();
  EXPECT_TRUE(std::find(frames.begin(), frames.end(), numbered(0x700)) != frames.end());
}

TEST_F(UnixCanHubTest, AClientThatDoesNotReadLosesFramesAndTheOthersDoNot) {
  UnixCan sleeping(path), awake(path);
  hub->poll();
  constexpr std::uint32_t count = 50'000;  // more than the 4 MiB that are asked for hold
  for (std::uint32_t i = 0; i < count; ++i) {
    hub->send(numbered(i));
    ASSERT_EQ(awake.receive(0us).value().frame, numbered(i));
  }
  EXPECT_GT(hub->counters().lost, 0u);
  std::uint32_t got = 0;
  while (sleeping.receive(0us)) ++got;
  EXPECT_EQ(got + hub->counters().lost, count);
  // A block of an SDO transfer must fit.
  EXPECT_GE(got, 128u);
}

TEST_F(UnixCanHubTest, ClientsComeAndGo) {
  const auto before = open_descriptors();
  for (int i = 0; i < 50; ++i) {
    UnixCan a(path);
    a.send(numbered(7));
    ASSERT_EQ(hub->poll().size(), 1u);
    ASSERT_EQ(hub->clients(), 1u);
  }
  hub->poll();
  EXPECT_EQ(hub->clients(), 0u);
  EXPECT_EQ(open_descriptors(), before);
}

TEST_F(UnixCanHubTest, TheLastWordsOfAClientAreHeard) {
  { UnixCan(path).send(numbered(9)); }
  EXPECT_EQ(hub->poll().size(), 1u);
}

TEST_F(UnixCanHubTest, ItsDescriptorTellsThatThereIsSomethingToDo) {
  const auto readable = [&] {
    pollfd one{hub->descriptor(), POLLIN, 0};
    return poll(&one, 1, 0) == 1;
  };
  EXPECT_FALSE(readable());
  UnixCan a(path);
  EXPECT_TRUE(readable());
  hub->poll();
  EXPECT_FALSE(readable());
  a.send(numbered(1));
  EXPECT_TRUE(readable());
  hub->poll();
  EXPECT_FALSE(readable());
}

TEST_F(UnixCanHubTest, WhatIsNoFrameIsCountedAndDropped) {
  UnixCan good(path);
  const base::FileDescriptor raw = raw_client(path);
  const std::array<std::uint8_t, 40> bytes{0, 8, 0, 0, 8};  // also: an identifier of more than 11 bits
  for (const std::size_t length : {1u, 15u, 16u, 17u, 40u})
    ASSERT_EQ(::send(raw.number(), bytes.data(), length, 0), static_cast<ssize_t>(length));
  EXPECT_TRUE(hub->poll().empty());
  EXPECT_EQ(hub->counters().malformed, 5u);
  EXPECT_FALSE(good.receive(0us));
  good.send(numbered(1));
  EXPECT_EQ(hub->poll().size(), 1u);
}

TEST_F(UnixCanHubTest, ASecondOneAtTheSamePathIsRefused) {
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub second(path); }), "another program serves");
  UnixCan client(path);  // and the first one is still there
  client.send(numbered(1));
  EXPECT_EQ(hub->poll().size(), 1u);
}

TEST(UnixCanHubAlone, WhatACrashedProgramLeftIsReplaced) {
  const TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  {
    const base::FileDescriptor abandoned(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
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

// A program that waits for the path may connect as soon as it sees it.
TEST(UnixCanHubAlone, APathThatIsThereIsServed) {
  const TemporaryFolder folder;
  std::string refusal;
  for (int i = 0; i < 300 && refusal.empty(); ++i) {
    const std::string path = (folder / fmt::format("bus{}", i)).string();
    std::thread waiting([&] {
      while (!std::filesystem::exists(path)) {
      }
      try {
        UnixCan port(path);
      } catch (const LinkError& error) {
        refusal = error.what();
      }
    });
    const UnixCanHub hub(path);
    waiting.join();
  }
  EXPECT_EQ(refusal, "");
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(UnixCanHubAlone, AnotherThingAtThePathIsLeftAlone) {
  const TemporaryFolder folder;
  const auto file = folder.write("bus", "precious");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub(file.string()); }), "not a socket");
  EXPECT_EQ(folder.read("bus"), "precious");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub((folder / "no/such/bus").string()); }),
                  "cannot make a socket");
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { UnixCanHub hub("/tmp/" + std::string(120, 'x')); }), "107");
}

TEST(UnixCanHubAlone, TheSocketOfASuccessorIsNotRemoved) {
  const TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  auto first = std::make_unique<UnixCanHub>(path);
  std::filesystem::rename(path, folder / "moved");
  const UnixCanHub second(path);
  first.reset();
  EXPECT_TRUE(std::filesystem::exists(path));
}

}  // namespace kmax::device::unix_can_test
