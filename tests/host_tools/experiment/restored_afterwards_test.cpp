#include "host_tools/experiment/restored_afterwards.hpp"

#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::restored_afterwards_test {
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

TEST_F(Restored, WhatCouldNotBePutBackIsTold) {
  set({"axis1.wall.stiffness=2222", "axis1.wall.law=magnetic", "link.timeout=0.5"});
  const auto notice = [this](const std::string& text) { told.push_back(text); };
  { const RestoredAfterwards restored(device, 1, {"wall.stiffness=5"}, notice); }
  EXPECT_TRUE(told.empty());
  {
    const RestoredAfterwards restored(device, 1, {"wall.stiffness=5", "wall.law", "link.timeout"}, notice);
    cable().cut = true;
  }
  ASSERT_EQ(told.size(), 1u);
  for (const char* part :
       {"the cable is gone", " axis1.wall.stiffness=2222", " axis1.wall.law=magnetic", " link.timeout=0.5"})
    EXPECT_CONTAINS(told[0], part);
}

TEST_F(Restored, ANoticeThatFailsEndsNothing) {
  const RestoredAfterwards restored(device, 0, {"wall.stiffness"},
                                    [](const std::string&) { throw std::runtime_error("full"); });
  cable().cut = true;
}

}  // namespace
}  // namespace kmax::experiment::restored_afterwards_test
