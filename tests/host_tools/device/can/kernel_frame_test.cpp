#include "host_tools/device/can/kernel_frame.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kmax::link::kernel_frame_test {
namespace {
using drivers::CanFrame;

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
  CanFrame frame;
  frame.identifier = 0x123;
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u);
  frame.remote = true;
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u | CAN_RTR_FLAG);
  frame.extended = true;
  EXPECT_EQ(to_kernel(frame).can_id, 0x123u | CAN_RTR_FLAG | CAN_EFF_FLAG);
}

TEST(KernelFrame, NothingOfTheSenderLeaksOut) {
  CanFrame frame;
  frame.length = 2;
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

}  // namespace
}  // namespace kmax::link::kernel_frame_test
