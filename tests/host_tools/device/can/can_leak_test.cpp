// Ten thousand reads over a CAN link cost neither memory nor descriptors: on a bus at a Unix socket, and on
// the interface that KMAX_TEST_CAN names.
#include <gtest/gtest.h>
#include <malloc.h>
#include <poll.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "host_tools/device/can/can_link.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/serve/can_connection.hpp"
#include "tests/host_tools/device/can/fake_sdo_server.hpp"
#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::device::can_leak_test {

using device::Parameter;
using host_tools_test::FakeSdoServer;

constexpr std::uint8_t node_id = 5;

/// A node in a thread whose every object is four bytes long. Unlike FakeSdoNode it remembers nothing, so that
/// its own memory stays the same.
class ForgetfulNode {
 public:
  explicit ForgetfulNode(const std::string& bus) : connection_(bus) {
    server_.read =
        [](FakeSdoServer::Object object) -> std::variant<FakeSdoServer::Bytes, FakeSdoServer::Abort> {
      if (object.index == 0x1F57) return FakeSdoServer::Abort::no_object;
      return FakeSdoServer::Bytes{0, 0, 0x7A, 0x44};
    };
    thread_ = std::thread([this] { serve(); });
  }
  ~ForgetfulNode() {
    stop_ = true;
    thread_.join();
  }

 private:
  void serve() {
    while (!stop_) {
      pollfd source{connection_.descriptor(), POLLIN, 0};
      ::poll(&source, 1, 10);
      for (const drivers::CanFrame& frame : connection_.received()) {
        if (frame.identifier != 0x600u + node_id) continue;
        for (const auto& data : server_.handle(frame.data)) {
          drivers::CanFrame reply{.identifier = 0x580u + node_id, .length = 8, .data = data};
          connection_.send(reply);
        }
      }
    }
  }

  serve::CanConnection connection_;
  FakeSdoServer server_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

void expect_no_leak(const std::string& bus) {
  constexpr int reads = 10'000, warming_up = 200;
  const std::size_t stiffness[] = {Parameter::of<"wall.stiffness">().slot()};
  const std::vector<std::uint32_t> expected{0x447A0000};
  ForgetfulNode node(bus);
  CanLink link(parse_device_address("can:" + bus + "?node=" + std::to_string(node_id)));
  std::size_t used = 0, descriptors = 0;
  for (int i = -warming_up; i < reads; ++i) {
    if (i == 0) {
      used = mallinfo2().uordblks;
      descriptors = open_descriptors();
    }
    ASSERT_EQ(link.read(stiffness), expected) << "read " << i;
  }
  // What a single read leaves behind would be thousands of times as much. Other threads' blocks, which come
  // and go, are some.
  EXPECT_LE(mallinfo2().uordblks, used + 4096);
  EXPECT_EQ(open_descriptors(), descriptors);
}

TEST(CanLeak, TenThousandReadsAtAUnixSocket) {
  const host_tools_test::TemporaryFolder folder;
  expect_no_leak((folder / "bus").string());
}

TEST(CanLeak, TenThousandReadsOnAnInterface) {
  const char* name = std::getenv("KMAX_TEST_CAN");
  if (name == nullptr || *name == '\0')
    GTEST_SKIP() << "KMAX_TEST_CAN names no interface (export KMAX_TEST_CAN=vcan0)";
  expect_no_leak(name);
}

/// Links that are opened and closed leave nothing either, nor do reads that fail.
TEST(CanLeak, AHundredLinksAndRefusals) {
  const host_tools_test::TemporaryFolder folder;
  const std::string bus = (folder / "bus").string();
  ForgetfulNode node(bus);
  std::size_t used = 0, descriptors = 0;
  for (int i = -20; i < 100; ++i) {
    if (i == 0) {
      used = mallinfo2().uordblks;
      descriptors = open_descriptors();
    }
    CanLink link(parse_device_address("can:" + bus + "?node=" + std::to_string(node_id)));
    EXPECT_THROW(link.sdo().upload({0x1F57, 1}), SdoAborted);
  }
  EXPECT_LE(mallinfo2().uordblks, used + 4096);
  // The hub lets go of a client that has left at its next poll.
  EXPECT_LE(open_descriptors(), descriptors + 2);
}

}  // namespace kmax::device::can_leak_test
