#include "firmware/watchdog_gate.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::watchdog_gate_test {
namespace {

TEST(WatchdogGate, FeedsOnlyWhenBothAxesHaveTicked) {
  WatchdogGate gate;
  EXPECT_FALSE(gate.may_feed());
  gate.ISR_ticked(0);
  EXPECT_FALSE(gate.may_feed());
  gate.ISR_ticked(0);
  EXPECT_FALSE(gate.may_feed());
  gate.ISR_ticked(1);
  EXPECT_TRUE(gate.may_feed());
}

TEST(WatchdogGate, EachFeedingNeedsBothTicksAgain) {
  WatchdogGate gate;
  gate.ISR_ticked(0);
  gate.ISR_ticked(1);
  ASSERT_TRUE(gate.may_feed());
  EXPECT_FALSE(gate.may_feed());
  gate.ISR_ticked(1);
  EXPECT_FALSE(gate.may_feed());
  gate.ISR_ticked(0);
  EXPECT_TRUE(gate.may_feed());
}

}  // namespace
}  // namespace kmax::firmware::watchdog_gate_test
