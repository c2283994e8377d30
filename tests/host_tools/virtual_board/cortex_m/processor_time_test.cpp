// Time and cycles of the emulated core: what an instruction knows of the moment at which it runs.

#include <gtest/gtest.h>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/cortex_m/program_on_core.hpp"

namespace kmax::virtual_board::processor_time_test {

using drivers::stm32f4::Interrupt;

constexpr unsigned tim2 = exception_number::first_interrupt + static_cast<unsigned>(Interrupt::tim2);
constexpr BoardTime cycle = ProgramOnCore::cycle;

std::vector<BoardTime> times(const RecordingBlock& block) {
  std::vector<BoardTime> all;
  for (const auto& record : block.records) all.push_back(record.now);
  return all;
}

TEST(ProcessorTime, GivesEveryAccessOfABlockTheEndOfItsOwnInstruction) {
  ProgramOnCore board({0xC006,          // stmia r0!, {r1, r2}       3 cycles
                       0xF840, 0x1B04,  // str.w r1, [r0], #4        1
                       0xF850, 0x2023,  // ldr.w r2, [r0, r3, lsl #2] 2
                       0xE9D0, 0x4502,  // ldrd r4, r5, [r0, #8]     3
                       0xE9D0, 0x0102,  // ldrd r0, r1, [r0, #8]     3, replaces its own base
                       0xBE01});
  board.set(0, ProgramOnCore::block_base).set(1, 1).set(2, 2).set(3, 4);
  ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  const std::vector<BoardTime> expected{3 * cycle, 3 * cycle, 4 * cycle,  6 * cycle,
                                        9 * cycle, 9 * cycle, 12 * cycle, 12 * cycle};
  EXPECT_EQ(times(board.block), expected);
  std::vector<std::uint32_t> offsets;
  for (const auto& record : board.block.records) offsets.push_back(record.offset);
  const std::vector<std::uint32_t> expected_offsets{0, 4, 8, 28, 20, 24, 20, 24};
  EXPECT_EQ(offsets, expected_offsets);
  EXPECT_EQ(board.processor.cycles(), 13U);
  EXPECT_EQ(board.processor.instructions(), 6U);
}

TEST(ProcessorTime, AttributesTheAccessToTheInstructionThatIfThenLeaves) {
  ProgramOnCore board({0x4280,  // cmp r0, r0
                       0xBF14,  // ite ne
                       0x6041,  // strne r1, [r0, #4]
                       0x6001,  // streq r1, [r0, #0]
                       0xBE01});
  board.set(0, ProgramOnCore::block_base);
  ASSERT_EQ(board.run(), RunEnd::stopped);
  const std::vector<BoardTime> expected{4 * cycle};
  EXPECT_EQ(times(board.block), expected);
}

TEST(ProcessorTime, ShowsCountersAsOfTheAccessingInstruction) {
  ProgramOnCore board({0x6801,          // ldr r1, [r0]      2 cycles
                       0x3401,          // adds r4, #1       1
                       0xFB94, 0xF5F4,  // sdiv r5, r4, r4   7
                       0x6802,          // ldr r2, [r0]      2
                       0x3401, 0xBE01});
  board.set(0, ProgramOnCore::block_base).set(4, 0);
  board.block.on_read = [&](const Access& access) {
    EXPECT_EQ(access.now, board.processor.now());
    EXPECT_EQ(access.now, board.processor.cycles() * cycle);
    return static_cast<std::uint32_t>(board.processor.cycles() << 8 | board.processor.instructions());
  };
  ASSERT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(1), 2U << 8 | 1);
  EXPECT_EQ(board.get(2), 12U << 8 | 4);
}

TEST(ProcessorTime, ChargesTakenBranchesWhenTheyAreTaken) {
  for (const std::uint32_t rounds : {1U, 2U, 50U}) {
    ProgramOnCore board({0x3801, 0xD1FD,  // subs r0, #1; bne
                         0xBE01});
    board.set(0, rounds);
    ASSERT_EQ(board.run(), RunEnd::stopped);
    EXPECT_EQ(board.processor.cycles(), 2 * rounds + 2 * (rounds - 1) + 1);
    EXPECT_EQ(board.processor.instructions(), 2 * rounds + 1);
  }
}

TEST(ProcessorTime, FollowsTheCoreClock) {
  ProgramOnCore board({0x6001,  // str r1, [r0]: slows the clock down
                       0xE7FF,  // b to the next     3
                       0x3201,  // adds              1
                       0xBE01});
  board.block.on_write = [&](const Access&, std::uint32_t) { board.clocks.core = 21; };
  board.set(0, ProgramOnCore::block_base);
  ASSERT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.processor.now(), 4 * cycle + 2 * 21);
}

TEST(ProcessorTime, CountsInstructionsAloneWhenAsked) {
  ProgramOnCore board({0x6801,          // ldr r1, [r0]
                       0xFB94, 0xF5F4,  // sdiv
                       0xE7FF,          // b to the next
                       0xBE01},
                      {.units_per_instruction = 7});
  board.core.exceptions.set_enabled(tim2, true);
  board.handler(tim2, {0x4770});
  board.core.exceptions.pend(tim2);
  board.set(0, ProgramOnCore::block_base);
  ASSERT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.processor.instructions(), 5U);
  EXPECT_EQ(board.processor.now(), 5U * 7);
  EXPECT_EQ(board.block.records.at(0).now, 2U * 7);
}

TEST(ProcessorTime, OvershootsByLessThanABlock) {
  ProgramOnCore board({0x3001, 0x3001, 0x3001, 0x3001, 0x3001, 0x3001, 0xE7F8});  // 9 cycles a round
  for (BoardTime limit = 1; limit < 400; limit += 7) {
    ASSERT_EQ(board.processor.run_until(limit), RunEnd::time_reached);
    EXPECT_GE(board.processor.now(), limit);
    EXPECT_LT(board.processor.now(), limit + 9 * cycle);
  }
}

// Whoever listens to blocks gets each of them: that is the reference.
TEST(ProcessorTime, GoesThroughAnEndlessLoopAsIfRoundByRound) {
  for (const auto first :
       {std::uint16_t{0xBF00}, std::uint16_t{0xB672}}) {  // nop; cpsid i: what is asked for waits
    for (const ProcessorConfig& config : {ProcessorConfig{}, ProcessorConfig{.units_per_instruction = 7}}) {
      ProgramOnCore quick({first, 0xE7FE}, config), slow({first, 0xE7FE}, config);
      std::uint64_t rounds = 0;
      slow.processor.on_block([&](std::uint32_t, std::uint32_t) { ++rounds; });
      for (ProgramOnCore* board : {&quick, &slow}) {
        board->handler(tim2, {0x3601, 0x4770});  // adds r6, #1; bx lr
        board->core.exceptions.set_enabled(tim2, true);
        board->core.exceptions.set_priority(tim2, 0x10);
        // An event at odd times, each of which asks for the interrupt.
        board->block.next_after = [board](BoardTime now) {
          board->core.exceptions.pend(tim2);
          return now + 12'347;
        };
        board->block.event = 1001;
        board->set(6, 0);
      }
      for (BoardTime limit = 1; limit < 600'000; limit += limit < 3000 ? 1 : 33'331) {
        ASSERT_EQ(quick.run(limit), RunEnd::time_reached);
        ASSERT_EQ(slow.run(limit), RunEnd::time_reached);
        ASSERT_EQ(quick.processor.now(), slow.processor.now()) << limit;
        ASSERT_EQ(quick.processor.cycles(), slow.processor.cycles()) << limit;
        ASSERT_EQ(quick.processor.instructions(), slow.processor.instructions()) << limit;
        ASSERT_EQ(quick.get(6), slow.get(6)) << limit;
      }
      EXPECT_EQ(quick.block.advanced, slow.block.advanced);
      EXPECT_GT(rounds, 10'000U);
    }
  }
}

TEST(ProcessorTime, ChargesEntryReturnAndTailChaining) {
  const Program idle{0xBF30, 0xBE01};  // wfi
  const auto cycles_of = [&](unsigned interrupts) {
    ProgramOnCore board(idle);
    for (unsigned index = 0; index < interrupts; ++index) {
      board.handler(tim2 + index, {0x4770});
      board.core.exceptions.set_enabled(tim2 + index, true);
    }
    EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
    const std::uint64_t before = board.processor.cycles();
    for (unsigned index = 0; index < interrupts; ++index) board.core.exceptions.pend(tim2 + index);
    EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
    return board.processor.cycles() - before;
  };
  const std::uint64_t bkpt = 1;
  const std::uint64_t bx = 3;
  EXPECT_EQ(cycles_of(1), bkpt + 12 + bx + 12);
  EXPECT_EQ(cycles_of(2), bkpt + 12 + bx + 6 + bx + 12);
  EXPECT_EQ(cycles_of(3), bkpt + 12 + bx + 6 + bx + 6 + bx + 12);
}

TEST(ProcessorTime, ChargesFloatingPointFramesWhenTheHandlerUsesTheUnit_LazyPreservation) {
  const Program use_and_wait{0xEE00, 0x2A10,  // vmov s0, r2
                             0xBF30,          // wfi
                             0xBE01};
  const auto cycles_of = [&](const Program& handler, bool lazy) {
    ProgramOnCore board(use_and_wait);
    board.core.system_control.write({offsetof(drivers::cortex_m::ScbRegisters, cpacr), 4, 0}, 0xFU << 20);
    if (!lazy)
      board.core.floating_point.write({0, 4, 0},
                                      drivers::cortex_m::floating_point_fpccr::AutomaticPreservation::mask);
    board.handler(tim2, handler);
    board.core.exceptions.set_enabled(tim2, true);
    EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
    const std::uint64_t before = board.processor.cycles();
    board.core.exceptions.pend(tim2);
    EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
    return board.processor.cycles() - before;
  };
  const Program plain{0x4770};
  const Program floating{0xEE00, 0x2A10, 0x4770};
  EXPECT_EQ(cycles_of(plain, true), 1 + 12 + 3 + 12U);
  EXPECT_EQ(cycles_of(floating, true), 1 + 12 + 17 + 1 + 3 + 12 + 17U);
  EXPECT_EQ(cycles_of(plain, false), 1 + 12 + 17 + 3 + 12 + 17U);
}

}  // namespace kmax::virtual_board::processor_time_test
