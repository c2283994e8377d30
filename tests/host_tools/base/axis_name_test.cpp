#include "host_tools/base/axis_name.hpp"

#include <gtest/gtest.h>

namespace kmax::base::axis_name_test {

TEST(AxisName, IsTheWordAndDigitsBeforeTheFirstDot) {
  EXPECT_EQ(split_axis("axis1.device.mass").axis, "axis1");
  EXPECT_EQ(split_axis("axis1.device.mass").rest, "device.mass");
  EXPECT_EQ(split_axis("axis100.").digits, "100");
  EXPECT_EQ(split_axis("axis0.").axis, "axis0");
  for (const char* none :
       {"", ".", "axis", "axis1", "axis.mass", "axisA.mass", "axis-1.mass", "axis 1.mass", "axis01.mass",
        "axis00.mass", "axis007.", "xaxis1.mass", "device.axis1.mass", "Axis1.mass"}) {
    EXPECT_EQ(split_axis(none).axis, "") << none;
    EXPECT_EQ(split_axis(none).rest, none);
  }
}

TEST(AxisName, OfAxis0NeedNotBeWritten) {
  EXPECT_EQ(without_axis_0("axis0.wall.law"), "wall.law");
  EXPECT_EQ(without_axis_0("axis00.wall.law"), "axis00.wall.law");
  EXPECT_EQ(without_axis_0("axis1.wall.law"), "axis1.wall.law");
  EXPECT_EQ(without_axis_0("axis0"), "axis0");
}

}  // namespace kmax::base::axis_name_test
