#include "host_tools/device/can/can_port.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "host_tools/device/link.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::can_port_test {

using drivers::CanFrame;
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
  CanFrame frame{.identifier = 0x585};
  EXPECT_TRUE(passes(frame, {}));
  EXPECT_TRUE(passes(frame, {{0x585, 0x7FF}}));
  EXPECT_TRUE(passes(frame, {{0x123, 0x7FF}, {0x5FF, 0x780}}));
  EXPECT_FALSE(passes(frame, {{0x584, 0x7FF}}));
  frame.remote = true;
  EXPECT_FALSE(passes(frame, {{0x585, 0x7FF}}));
  EXPECT_TRUE(passes(frame, {}));
}

RC_GTEST_PROP(KernelFrame, ThereAndBackIsTheSame, ()) {
  CanFrame frame;
  frame.extended = *rc::gen::arbitrary<bool>();
  frame.remote = *rc::gen::arbitrary<bool>();
  frame.identifier = *rc::gen::inRange<std::uint32_t>(0, frame.extended ? 1u << 29 : 1u << 11);
  frame.length = *rc::gen::inRange<std::uint8_t>(0, 9);
  for (auto& byte : frame.data) byte = *rc::gen::arbitrary<std::uint8_t>();
  const auto back = from_kernel(to_kernel(frame));
  RC_ASSERT(back.has_value());
  RC_ASSERT(*back == frame);
}

TEST(KernelFrame, HasTheKernelsFlags) {
  CanFrame frame{.identifier = 0x123};
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u);
  frame.remote = true;
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u | CAN_RTR_FLAG);
  frame.extended = true;
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u | CAN_RTR_FLAG | CAN_EFF_FLAG);
}

TEST(KernelFrame, NothingOfTheSenderLeaksOut) {
  CanFrame frame{.length = 2};
  frame.data.fill(0x55);
  const can_frame kernel = to_kernel(frame);
  EXPECT_EQ(kernel.data[1], 0x55);
  EXPECT_EQ(kernel.data[2], 0);
  frame.remote = true;
  EXPECT_EQ(to_kernel(frame).data[0], 0);
}

TEST(KernelFrame, WhatIsNoFrameIsNone) {
  can_frame kernel{};
  kernel.can_id = 0x123;
  kernel.can_dlc = 9;
  EXPECT_FALSE(from_kernel(kernel));
  kernel.can_dlc = 8;
  EXPECT_TRUE(from_kernel(kernel));
  kernel.can_id = 0x800;  // more than 11 bits, not marked as extended
  EXPECT_FALSE(from_kernel(kernel));
  kernel.can_id = 0x800 | CAN_EFF_FLAG;
  EXPECT_TRUE(from_kernel(kernel));
  kernel.can_id = 0x40 | CAN_ERR_FLAG;
  EXPECT_FALSE(from_kernel(kernel));
}

}  // namespace kmax::device::can_port_test
