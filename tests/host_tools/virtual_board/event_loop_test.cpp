#include "host_tools/virtual_board/event_loop.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/cortex_m/program_on_core.hpp"

namespace kmax::virtual_board::event_loop_test {

using drivers::stm32f4::Interrupt;

constexpr unsigned tim2 = exception_number::first_interrupt + static_cast<unsigned>(Interrupt::tim2);
constexpr BoardTime cycle = ProgramOnCore::cycle;

const Program sleep_for_ever{0xBF30, 0xE7FD};  // wfi; b back
const Program count_handler{0x3601, 0x4770};   // adds r6, #1; bx lr

TEST(EventLoop, JumpsOverSleepToEachEventExactly) {
  ProgramOnCore board(sleep_for_ever);
  board.block.event = 1001;
  board.block.next_after = [](BoardTime now) { return now + 100'000; };
  EXPECT_EQ(board.run(1'000'000), RunEnd::time_reached);
  EXPECT_EQ(board.processor.now(), 1'000'000U);
  ASSERT_EQ(board.block.advanced.size(), 10U);
  EXPECT_EQ(board.block.advanced.front(), 1001U);
  EXPECT_EQ(board.block.advanced.back(), 901'001U);
  EXPECT_LT(board.processor.instructions(), 5U) << "an event without an interrupt does not wake the core";
}

TEST(EventLoop, WakesTheCoreAtTheEventsTime) {
  ProgramOnCore board(sleep_for_ever);
  board.handler(tim2, {0x6001, 0x4770});  // str r1, [r0]; bx lr
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, ProgramOnCore::block_base);
  board.block.event = 5000;
  board.block.next_after = [&](BoardTime) {
    board.core.exceptions.pend(tim2);
    return never;
  };
  EXPECT_EQ(board.run(10'000), RunEnd::time_reached);
  ASSERT_EQ(board.block.records.size(), 1U);
  EXPECT_EQ(board.block.records[0].now, 5000 + (12 + 1) * cycle);
}

TEST(EventLoop, BringsPeripheralsUpToDateBeforeAnAccessInTheMiddleOfABlock) {
  // The event falls between the two loads of one block; the second one must see it.
  ProgramOnCore board({0x6801,          // ldr r1, [r0]      ends at cycle 2
                       0xFB94, 0xF5F4,  // sdiv              9
                       0xFB94, 0xF5F4,  // sdiv              16
                       0x6802,          // ldr r2, [r0]      18
                       0xBE01});
  board.set(0, ProgramOnCore::block_base).set(4, 1);
  board.block.event = 10 * cycle + 1;
  board.block.next_after = [&](BoardTime now) {
    board.block.value = static_cast<std::uint32_t>(now);
    return never;
  };
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(1), 0U);
  EXPECT_EQ(board.get(2), 10 * cycle + 1);
  ASSERT_EQ(board.block.advanced.size(), 1U);
}

TEST(EventLoop, TakesAnEventIntoAccountThatAnAccessBringsForward) {
  // The write of the first block makes an event due before the run's limit; the interrupt must not wait for
  // the limit.
  ProgramOnCore board({0x6001,            // str r1, [r0]
                       0xE7FF,            // b to the next
                       0x3201, 0xE7FD});  // loop: adds r2, #1; b back      4 cycles a round
  board.handler(tim2, {0xBE04});
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, ProgramOnCore::block_base).set(2, 0);
  board.block.on_write = [&](const Access& access, std::uint32_t) {
    board.block.event = access.now + 40 * cycle;
  };
  board.block.next_after = [&](BoardTime) {
    board.core.exceptions.pend(tim2);
    return never;
  };
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.processor.breakpoint(), 4);
  ASSERT_EQ(board.block.advanced.size(), 1U);
  EXPECT_EQ(board.block.advanced[0], 41 * cycle);
  EXPECT_GE(board.get(2), 9U);
  EXPECT_LE(board.get(2), 11U);
}

TEST(EventLoop, WhatAnEventThrowsEndsTheRunInTheMiddleOfAProgram) {
  ProgramOnCore board({0x3201, 0xE7FD});  // loop: adds r2, #1; b back
  board.set(2, 0);
  board.block.event = 40 * cycle;
  board.block.next_after = [](BoardTime) -> BoardTime { throw std::runtime_error("the supply is gone"); };
  try {
    board.run();
    FAIL() << "it goes on";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the supply is gone");
  }
  EXPECT_EQ(board.get(2), 10U) << "4 cycles a round";
  board.block.next_after = [](BoardTime) { return never; };
  EXPECT_EQ(board.run(80 * cycle), RunEnd::time_reached);
  EXPECT_EQ(board.get(2), 20U) << "where it was";
}

TEST(EventLoop, AnEventThatStopsTheProcessorStopsItThere) {
  ProgramOnCore board({0x3201, 0xE7FD});
  board.set(2, 0);
  board.block.event = 40 * cycle;
  board.block.next_after = [&](BoardTime) {
    board.processor.stop();
    return never;
  };
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(2), 10U);
}

TEST(EventLoop, EventsComeWhenDueWhileTheCoreIsLockedUp) {
  ProcessorConfig config{.faults_to_firmware = true, .locks_up = true};
  const Program undefined{0xDE00};
  ProgramOnCore board(undefined, config);
  board.handler(exception_number::hard_fault, undefined);
  board.block.event = 1000;
  board.block.next_after = [](BoardTime now) { return now + 1000; };
  EXPECT_EQ(board.run(5500), RunEnd::time_reached);
  EXPECT_TRUE(board.processor.locked_up());
  EXPECT_EQ(board.block.advanced, (std::vector<BoardTime>{1000, 2000, 3000, 4000, 5000}));
  EXPECT_EQ(board.processor.now(), 5500U);
}

TEST(EventLoop, TicksWithoutDrift) {
  ProgramOnCore board(sleep_for_ever);
  board.handler(exception_number::system_tick, count_handler);
  board.set(6, 0);
  using drivers::cortex_m::SystemTickRegisters;
  board.core.system_tick.write({offsetof(SystemTickRegisters, load), 4, 0}, 167'999);
  board.core.system_tick.write({offsetof(SystemTickRegisters, val), 4, 0}, 0);
  board.core.system_tick.write({offsetof(SystemTickRegisters, ctrl), 4, 0}, 7);
  EXPECT_EQ(board.run(units_per_second + 1000), RunEnd::time_reached);
  EXPECT_EQ(board.get(6), 1000U);
}

TEST(EventLoop, AdvancesInOrderOfTimeAndOfAddingAtTheSameTime) {
  ProgramOnCore board(sleep_for_ever);
  std::vector<int> order;
  RecordingBlock first;
  RecordingBlock second;
  for (auto* block : {&first, &second}) block->event = 100;
  first.next_after = [&](BoardTime now) {
    order.push_back(1);
    return now + 100;
  };
  second.next_after = [&](BoardTime now) {
    order.push_back(2);
    return now + 50;
  };
  board.loop.add(first);
  board.loop.add(second);
  board.run(220);
  const std::vector<int> expected{1, 2, 2, 1, 2};
  EXPECT_EQ(order, expected);
}

TEST(EventLoop, FindsAPeripheralThatDoesNotMoveOn) {
  ProgramOnCore board(sleep_for_ever);
  board.block.event = 100;
  board.block.next_after = [](BoardTime now) { return now; };
  EXPECT_THROW(board.run(1000), std::logic_error);
}

}  // namespace kmax::virtual_board::event_loop_test
