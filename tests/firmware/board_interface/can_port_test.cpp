#include "firmware/board_interface/can_port.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::can_port_test {
namespace {

TEST(CanState, ItsNumbersAreThoseOfTheParameter) {
  EXPECT_EQ(static_cast<int>(CanState::absent), 0);
  EXPECT_EQ(static_cast<int>(CanState::stopped), 1);
  EXPECT_EQ(static_cast<int>(CanState::joining), 2);
  EXPECT_EQ(static_cast<int>(CanState::active), 3);
  EXPECT_EQ(static_cast<int>(CanState::error_passive), 4);
  EXPECT_EQ(static_cast<int>(CanState::bus_off), 5);
}

TEST(CanReadings, ABoardThatSaysNothingHasNoController) {
  const CanReadings readings;
  EXPECT_EQ(readings.state, CanState::absent);
  EXPECT_EQ(readings.transmit_errors, 0);
  EXPECT_EQ(readings.receive_errors, 0);
  EXPECT_EQ(readings.received, 0u);
  EXPECT_EQ(readings.sent, 0u);
  EXPECT_EQ(readings.overruns, 0u);
  EXPECT_EQ(readings.bus_offs, 0u);
  EXPECT_EQ(readings.discarded, 0u);
}

}  // namespace
}  // namespace kmax::firmware::can_port_test
