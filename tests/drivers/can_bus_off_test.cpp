#include "drivers/stm32f4/can_bus_off.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace kmax::drivers::stm32f4::can_bus_off_test {

using Action = CanBusOffAction;
using State = CanBusState;

struct Node {
  Node() {
    machine.start();
    EXPECT_EQ(poll(0, false, true), Action::none);
    EXPECT_EQ(machine.state(), State::joining);
    EXPECT_TRUE(machine.may_send());
    poll(1, false, false);
    EXPECT_TRUE(machine.may_send());
    EXPECT_EQ(machine.state(), State::on_bus);
  }
  Action poll(std::uint32_t after_us, bool bus_off, bool initialization) {
    return machine.poll(now += after_us, bus_off, initialization);
  }
  /// Falls now, comes back as soon as it may; the time in between.
  std::uint32_t fall_and_recover() {
    EXPECT_EQ(poll(0, true, false), Action::drop_frames);
    const std::uint32_t begin = now;
    EXPECT_FALSE(machine.may_send());
    while (poll(1000, true, false) != Action::request_initialization) {
      EXPECT_LT(now - begin, 5'000'000U);
      if (now - begin > 5'000'000U) return 0;
    }
    const std::uint32_t waited = now - begin;
    EXPECT_EQ(poll(1, true, false), Action::none);
    EXPECT_EQ(poll(1, true, true), Action::leave_initialization);
    EXPECT_EQ(poll(1, true, true), Action::none);
    EXPECT_EQ(poll(1, true, false), Action::none);
    EXPECT_EQ(poll(1, false, false), Action::resume);
    EXPECT_EQ(machine.state(), State::on_bus);
    return waited;
  }
  CanBusOff machine;
  std::uint32_t now = 0xFFFF'0000;  // wraps soon
};

TEST(CanBusOff, WaitDoublesUpToTwoSeconds) {
  Node node;
  for (const std::uint32_t wait :
       {100'000U, 200'000U, 400'000U, 800'000U, 1'600'000U, 2'000'000U, 2'000'000U}) {
    EXPECT_EQ(node.fall_and_recover(), wait);
  }
  EXPECT_EQ(node.machine.counters().bus_offs, 7U);
}

TEST(CanBusOff, StableSecondMakesTheWaitShortAgain) {
  for (const auto& [stayed, wait] : {std::pair{999'999U, 400'000U}, {1'000'000U, 100'000U}}) {
    Node node;
    node.fall_and_recover();
    node.fall_and_recover();
    node.poll(stayed, false, false);
    EXPECT_EQ(node.fall_and_recover(), wait) << stayed;
  }
}

TEST(CanBusOff, HoursOnTheBusDoNotWrapAround) {
  Node node;
  for (int i = 0; i < 10'000; ++i) ASSERT_EQ(node.poll(900'000, false, false), Action::none);
  EXPECT_EQ(node.fall_and_recover(), 100'000U);
}

TEST(CanBusOff, StuckBusStaysWhereItIs) {
  Node node;
  node.poll(0, true, false);
  node.poll(100'000, true, false);
  node.poll(1, true, true);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(node.poll(100'000, true, false), Action::none);
  EXPECT_EQ(node.machine.state(), State::recovering);
  EXPECT_FALSE(node.machine.may_send());
}

TEST(CanBusOff, StoppedDoesNothing) {
  Node node;
  node.machine.stop();
  EXPECT_EQ(node.poll(1, true, true), Action::none);
  EXPECT_EQ(node.machine.state(), State::off);
}

}  // namespace kmax::drivers::stm32f4::can_bus_off_test
