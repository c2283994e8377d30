#include "host_tools/device/can/can_port.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "host_tools/device/link.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::can_port_test {
namespace {
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

TEST(CanPort, ASlashMakesItAPath) {
  EXPECT_TRUE(is_socket_path("/tmp/bus"));
  EXPECT_TRUE(is_socket_path("./can0"));
  EXPECT_FALSE(is_socket_path("can0"));
  const TemporaryFolder folder;
  const UnixCanHub hub((folder / "bus").string());
  EXPECT_EQ(open_can_port(hub.path())->description(), hub.path());
  EXPECT_CONTAINS(thrown_message<LinkError>([] { open_can_port("no_such_can"); }), "no_such_can");
}

TEST(CanPort, AFilterIsAboutStandardDataFrames) {
  drivers::CanFrame frame;
  frame.identifier = 0x585;
  EXPECT_TRUE(passes(frame, {}));
  EXPECT_TRUE(passes(frame, {{0x585, 0x7FF}}));
  EXPECT_TRUE(passes(frame, {{0x123, 0x7FF}, {0x5FF, 0x780}}));
  EXPECT_FALSE(passes(frame, {{0x584, 0x7FF}}));
  frame.remote = true;
  EXPECT_FALSE(passes(frame, {{0x585, 0x7FF}}));
  EXPECT_TRUE(passes(frame, {}));
}

}  // namespace
}  // namespace kmax::link::can_port_test
