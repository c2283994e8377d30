#include "host_tools/experiment/restored_afterwards.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/errors.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"

namespace kmax::experiment {
namespace {

using Restored = TouchedBoard;

TEST_F(Restored, WhatWasThereIsThereAgainOnTheAxisThatWasMeant) {
  set({"wall.stiffness=1111", "axis1.wall.stiffness=2222", "link.timeout=0.5"});
  {
    const RestoredAfterwards restored(device, 1, {"wall.stiffness=5", "link.timeout", "wall.stiffness"});
    set({"wall.stiffness=3", "axis1.wall.stiffness=4", "link.timeout=2"});
  }
  EXPECT_EQ(device.read_number("axis1.wall.stiffness"), 2222);
  EXPECT_EQ(device.read_number("link.timeout"), 0.5);
  EXPECT_EQ(device.read_number("wall.stiffness"), 3);  // of axis 0, which was not named
}

TEST_F(Restored, AnUnknownNameIsRefusedAndALostLinkIsNot) {
  EXPECT_THROW(RestoredAfterwards(device, 0, {"wall.stifness"}), device::ValueError);
  {
    const RestoredAfterwards restored(device, 0, {"wall.stiffness"});
    cable().cut = true;
  }
  cable().cut = false;
  EXPECT_NO_THROW(device.read_number("wall.stiffness"));
}

}  // namespace
}  // namespace kmax::experiment
