// Instructions, exceptions and sleep on the emulated core. PM0214 chapters and sections in the names.

#include "host_tools/virtual_board/cortex_m/processor.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <stdexcept>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/cortex_m/program_on_core.hpp"

namespace kmax::virtual_board::processor_test {

using drivers::stm32f4::Interrupt;

constexpr unsigned tim2 = exception_number::first_interrupt + static_cast<unsigned>(Interrupt::tim2);
constexpr std::uint32_t pend_word =
    drivers::cortex_m::nvic_base + offsetof(drivers::cortex_m::NvicRegisters, ispr);
constexpr std::uint32_t tim2_bit = 1U << static_cast<unsigned>(Interrupt::tim2);

const Program count_handler{0x3601,   // adds r6, #1
                            0x4770};  // bx lr
const Program copy_handler{0x4617,    // mov r7, r2
                           0x4770};   // bx lr
const Program wait{0xBF30,            // wfi
                   0x3001,            // adds r0, #1
                   0xBE01};           // bkpt 1
const Program pend_then_more{0x6001,  // str r1, [r0]
                             0x3201,  // adds r2, #1
                             0x3201,  // adds r2, #1
                             0xE7FF,  // b to the next
                             0x3204,  // adds r2, #4
                             0xBE01};

TEST(Processor, StartsWithStackAndProgramCounterOfTheVectorTable_ResetException) {
  ProgramOnCore board({0xBE07});
  EXPECT_EQ(board.get(13), ProgramOnCore::initial_stack);
  EXPECT_EQ(board.processor.program_counter(), ProgramOnCore::program_base);
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.processor.breakpoint(), 7);
  board.set(13, 0x2000'0000);
  board.processor.reset(board.processor.now());
  EXPECT_EQ(board.get(13), ProgramOnCore::initial_stack);
  EXPECT_EQ(board.processor.breakpoint(), -1);
}

TEST(Processor, RefusesToStartWithoutAProgram) {
  Bus bus;
  BoardClocks clocks;
  CorePeripherals core(bus, clocks, 82);
  Processor processor(bus, core, clocks);
  EXPECT_THROW(processor.reset(0), std::runtime_error);
}

TEST(Processor, TakesAnInterruptThatARegisterWriteRaisesBeforeTheNextBlock_ExceptionEntry) {
  ProgramOnCore board(pend_then_more);
  board.handler(tim2, copy_handler);
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, pend_word).set(1, tim2_bit).set(2, 0).set(7, 99);
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(7), 2U);  // both additions of the writing block, none of the next one
  EXPECT_EQ(board.get(2), 6U);
  EXPECT_EQ(board.get(13), ProgramOnCore::initial_stack);
  EXPECT_FALSE(board.core.exceptions.active(tim2));
}

TEST(Processor, StacksEightWordsBelowAStackAlignedToEight_ExceptionEntry) {
  for (const std::uint32_t misaligned : {0U, 4U}) {
    ProgramOnCore board(pend_then_more);
    board.handler(tim2, {0xBE02});
    board.core.exceptions.set_enabled(tim2, true);
    const std::uint32_t sp = ProgramOnCore::initial_stack - misaligned;
    board.set(0, pend_word)
        .set(1, tim2_bit)
        .set(2, 0)
        .set(3, 33)
        .set(12, 12)
        .set(14, 0x0800'0777)
        .set(13, sp);
    ASSERT_EQ(board.run(), RunEnd::stopped);
    EXPECT_EQ(board.processor.breakpoint(), 2);
    const std::uint32_t frame = (sp - 32) & ~7U;
    EXPECT_EQ(board.get(13), frame);
    EXPECT_EQ(board.get(14), 0xFFFF'FFF9U);
    EXPECT_EQ(board.bus.load(frame), pend_word);
    EXPECT_EQ(board.bus.load(frame + 4), tim2_bit);
    EXPECT_EQ(board.bus.load(frame + 8), 2U);
    EXPECT_EQ(board.bus.load(frame + 12), 33U);
    EXPECT_EQ(board.bus.load(frame + 16), 12U);
    EXPECT_EQ(board.bus.load(frame + 20), 0x0800'0777U);
    EXPECT_EQ(board.bus.load(frame + 24), ProgramOnCore::program_base + 8);
    EXPECT_EQ(*board.bus.load(frame + 28) & 0x0100'0200U, 0x0100'0000U | (misaligned != 0 ? 0x200U : 0U));
    EXPECT_EQ(drivers::cortex_m::scb_icsr::ActiveVector::of(
                  board.core.system_control.read({offsetof(drivers::cortex_m::ScbRegisters, icsr), 4, 0})),
              tim2);
  }
}

TEST(Processor, SleepsUntilAnInterruptThatIsNotMasked_WaitForInterrupt) {
  ProgramOnCore board(wait);
  board.handler(tim2, count_handler);
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, 0).set(6, 0);
  EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
  board.processor.sleep_until(5000);
  EXPECT_EQ(board.processor.now(), 5000U);
  EXPECT_EQ(board.processor.run_until(6000), RunEnd::sleeping);
  const std::uint64_t cycles = board.processor.cycles();
  board.core.nvic.set_level(Interrupt::tim2, true);
  board.core.nvic.set_level(Interrupt::tim2, false);
  EXPECT_EQ(board.processor.run_until(6000), RunEnd::stopped);
  EXPECT_EQ(board.get(0), 1U);
  EXPECT_EQ(board.get(6), 1U);
  EXPECT_LT(board.processor.cycles(), cycles + 100);
  EXPECT_GT(board.processor.slept(), 4900U);
}

TEST(Processor, WakesWithoutServingWhenPrimaskMasks_WaitForInterrupt) {
  ProgramOnCore board({0xB672,  // cpsid i
                       0xBF30,  // wfi
                       0x3001,  // adds r0, #1
                       0x4637,  // mov r7, r6
                       0xB662,  // cpsie i
                       0x3010,  // adds r0, #16
                       0xBE01});
  board.handler(tim2, count_handler);
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, 0).set(6, 0).set(7, 7);
  EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
  board.core.exceptions.pend(tim2);
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(0), 17U);
  EXPECT_EQ(board.get(7), 0U);
  EXPECT_EQ(board.get(6), 1U);
}

TEST(Processor, StaysAsleepForAnInterruptBelowBasepri_WaitForInterrupt) {
  ProgramOnCore board({0xF380, 0x8811,  // msr basepri, r0
                       0xBF30,          // wfi
                       0xBE01});
  board.handler(tim2, count_handler);
  board.core.exceptions.set_enabled(tim2, true);
  board.core.exceptions.set_priority(tim2, 0x80);
  board.set(0, 0x80);
  EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
  board.core.exceptions.pend(tim2);
  EXPECT_EQ(board.processor.run_until(1000), RunEnd::sleeping);
  board.core.exceptions.set_priority(tim2, 0x70);
  EXPECT_EQ(board.processor.run_until(1000), RunEnd::stopped);
}

TEST(Processor, DoesNotWaitForEvents_WaitForEvent) {
  ProgramOnCore board({0xBF00,  // nop
                       0xBF20,  // wfe
                       0xBF40,  // sev
                       0xBF10,  // yield
                       0x3001,  // adds r0, #1
                       0xBE01});
  board.set(0, 0);
  EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.get(0), 1U);
}

TEST(Processor, ReturnsToTheHandlerLevelThatIsStillAsserted_LevelSensitiveInterrupts) {
  // The line stays high for three rounds: the handler runs three times without anybody pending it.
  ProgramOnCore board({0xBF30, 0xE7FD});  // wfi; b back
  board.handler(tim2, {0x6001,  // str r1, [r0]: makes the block take its line back in the third round
                       0x4770});
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, ProgramOnCore::block_base);
  int rounds = 0;
  board.block.on_write = [&](const Access&, std::uint32_t) {
    if (++rounds == 3) board.core.nvic.set_level(Interrupt::tim2, false);
  };
  board.core.nvic.set_level(Interrupt::tim2, true);
  EXPECT_EQ(board.run(10'000), RunEnd::time_reached) << board.processor.fault();
  EXPECT_EQ(rounds, 3);
}

TEST(Processor, EndsTheRunForAResetRequest_SystemReset) {
  ProgramOnCore board(pend_then_more);
  board.set(0, drivers::cortex_m::scb_base + offsetof(drivers::cortex_m::ScbRegisters, aircr))
      .set(1, 0x05FA'0004)
      .set(2, 0);
  BoardTime requested = 0;
  board.core.system_control.on_reset_request([&](BoardTime now) { requested = now; });
  EXPECT_EQ(board.run(), RunEnd::reset_requested);
  EXPECT_EQ(requested, 1 * ProgramOnCore::cycle);
  EXPECT_EQ(board.get(2), 2U);  // to the end of the block
  board.processor.reset(board.processor.now());
  EXPECT_EQ(board.processor.program_counter(), ProgramOnCore::program_base);
  board.set(0, 0x2000'0100);
  EXPECT_EQ(board.run(), RunEnd::stopped);
}

TEST(Processor, ClearsMasksModeAndStackSelectionOnReset_ResetException) {
  ProgramOnCore board({0xB672,          // cpsid i
                       0x2203,          // movs r2, #3
                       0xF382, 0x8814,  // msr control, r2: unprivileged, process stack
                       0xF3BF, 0x8F6F,  // isb
                       0xBE01});
  ASSERT_EQ(board.run(), RunEnd::stopped);
  board.processor.reset(board.processor.now());
  EXPECT_FALSE(board.processor.masks().primask);
  EXPECT_EQ(board.get(13), ProgramOnCore::initial_stack);
  EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
}

TEST(Processor, StopsOnDemand) {
  ProgramOnCore board({0x6801,    // ldr r1, [r0]
                       0xE7FD});  // b back
  board.set(0, ProgramOnCore::block_base);
  int reads = 0;
  board.block.on_read = [&](const Access&) {
    if (++reads == 5) board.processor.stop();
    return 0U;
  };
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(reads, 5);
  EXPECT_EQ(board.processor.breakpoint(), -1);
  EXPECT_EQ(board.run(board.processor.now() + 100), RunEnd::time_reached);
}

TEST(Processor, TellsOfEveryBlockWhenAsked) {
  ProgramOnCore board({0x2003,          // movs r0, #3
                       0x3801, 0xD1FD,  // subs r0, #1; bne
                       0xF3BF, 0x8F4F,  // dsb
                       0xBE01});
  std::vector<std::uint32_t> seen;
  board.processor.on_block([&](std::uint32_t address, std::uint32_t /*size*/) {
    seen.push_back(address - ProgramOnCore::program_base);
  });
  EXPECT_EQ(board.run(), RunEnd::stopped);
  const std::vector<std::uint32_t> expected{0, 2, 2, 6};
  EXPECT_EQ(seen, expected);
}

// The emulator makes two blocks of an IT block that the end of a 1 KiB page cuts, and forgets the condition
// when it is stopped in between: a soft-float multiplication that lay so ran for ever.
TEST(Processor, KeepsTheConditionOfAnIfThenThatThePageEndCuts_IfThenBlocks) {
  for (const std::uint32_t compared : {0U, 1U}) {
    Program program((0x0800'03FC - ProgramOnCore::program_base) / 2, 0xBF00);  // nop
    const Program end{0x2801,                                                  // cmp r0, #1
                      0xBF18,  // it ne, the page's last half word
                      0x3101,  // addne r1, #1
                      0xBE01};
    program.insert(program.end(), end.begin(), end.end());
    ProgramOnCore board(program);
    board.set(0, compared).set(1, 0);
    // Stopped wherever that is possible.
    RunEnd ended = RunEnd::time_reached;
    for (BoardTime limit = 1; ended == RunEnd::time_reached && limit < 2000; ++limit)
      ended = board.run(limit);
    EXPECT_EQ(ended, RunEnd::stopped) << board.processor.fault();
    EXPECT_EQ(board.get(1), compared == 1 ? 0U : 1U);
  }
}

// Written, run, written over and run again: stores_beside_code.hpp. Both engines have stored there before any
// of them ran code in RAM.
TEST(Processor, RunsWhatWasStoredToRamLast) {
  constexpr std::uint32_t place = 0x2000'0800;
  const Program program{0x8016,   // strh r6, [r2]
                        0xBF30,   // wfi
                        0x8013,   // strh r3, [r2]
                        0x4780,   // blx r0
                        0x460C,   // mov r4, r1
                        0x8015,   // strh r5, [r2]
                        0x4780,   // blx r0
                        0xBE01};  // bkpt 1
  std::deque<ProgramOnCore> boards;
  for (int engine = 0; engine < 2; ++engine) {
    ProgramOnCore& board = boards.emplace_back(program);
    board.place(place, {0xBE02, 0x4770});  // bkpt 2, bx lr
    // movs r1, #1 or #2
    board.set(0, place | 1).set(2, place).set(3, 0x2101).set(5, 0x2102).set(6, 0x2103);
    board.run(1'000);
    ASSERT_TRUE(board.processor.sleeping());
  }
  for (ProgramOnCore& board : boards) {
    board.set(15, ProgramOnCore::program_base + 4);
    ASSERT_EQ(board.run(), RunEnd::stopped);
    ASSERT_EQ(board.processor.breakpoint(), 1);
    EXPECT_EQ(board.get(4), 1U);
    EXPECT_EQ(board.get(1), 2U);
  }
}

// SRAM1 at address 0: RM0090, SYSCFG_MEMRMP. As data it can be stored to meanwhile, and what is fetched
// follows; and what was stored while it was not there holds when it is again.
TEST(Processor, FetchesAtZeroWhatWasStoredToSram) {
  constexpr std::uint32_t place = 0x800, stored_at = 0x2000'0000 + place;
  ProgramOnCore board({0x4780,               // blx r0
                       0x460C,               // mov r4, r1
                       0x8015,               // strh r5, [r2]
                       0x4780,               // blx r0
                       0xBE01});             // bkpt 1
  board.place(stored_at, {0x2101, 0x4770});  // movs r1, #1; bx lr
  const auto set_up = [&board] {
    board.set(0, place | 1).set(2, stored_at).set(5, 0x2102).set(15, ProgramOnCore::program_base);
  };
  for (int round = 0; round < 2; ++round) {
    board.place(stored_at, {static_cast<std::uint16_t>(0x2101 + 6 * round), 0x4770});
    board.bus.show_sram_at_zero(true);
    set_up();
    ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
    ASSERT_EQ(board.processor.breakpoint(), 1);
    EXPECT_EQ(board.get(4), 1U + 6U * static_cast<unsigned>(round)) << "round " << round;
    EXPECT_EQ(board.get(1), 2U) << "round " << round;
    board.bus.show_sram_at_zero(false);
    board.processor.reset(board.processor.now());
    board.set(15, ProgramOnCore::program_base + 8);
    ASSERT_EQ(board.run(), RunEnd::stopped);
    board.processor.reset(board.processor.now());
  }
  set_up();
  ASSERT_EQ(board.run(), RunEnd::fault);
  EXPECT_NE(board.processor.fault().find("there is nothing at this address"), std::string::npos)
      << board.processor.fault();
}

TEST(Processor, TellsOfLoadsAndStoresWhenAsked) {
  ProgramOnCore board({0x6808,    // ldr r0, [r1]
                       0x6053,    // str r3, [r2, #4]
                       0x6820,    // ldr r0, [r4]
                       0x4801,    // ldr r0, [pc, #4]
                       0xB401,    // push {r0}
                       0xBE01});  // bkpt 1
  std::vector<std::uint32_t> seen;
  board.processor.on_data_access([&seen](std::uint32_t address) { seen.push_back(address); });
  board.set(1, 0x2000'0100).set(2, 0x1000'0200).set(4, ProgramOnCore::block_base);
  EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  // The literal lies at the program's word 3, behind the bkpt.
  const std::vector<std::uint32_t> expected{0x2000'0100, 0x1000'0204, ProgramOnCore::program_base + 12,
                                            ProgramOnCore::initial_stack - 4};
  std::erase(seen, ProgramOnCore::block_base);
  EXPECT_EQ(seen, expected);
}

// The manual would let it; no firmware should.
TEST(Processor, RefusesStoresToSramAtZero) {
  ProgramOnCore board({0x6001, 0xBE01});  // str r1, [r0]; bkpt 1
  board.bus.show_sram_at_zero(true);
  board.set(0, 0x800).set(1, 1);
  EXPECT_EQ(board.run(), RunEnd::fault);
  EXPECT_EQ(board.bus.load(0x800), board.bus.load(0x2000'0800));
  EXPECT_NE(board.bus.load(0x800), 1U);
}

// The branch's target is translated before the interrupt is taken.
TEST(Processor, RunsWhatAnInterruptStoredToRamBeforeItsFirstRun) {
  constexpr std::uint32_t place = 0x2000'0800;
  ProgramOnCore board({0x8013,            // strh r3, [r2]
                       0x6037,            // str r7, [r6]
                       0x4780,            // blx r0
                       0xBE01});          // bkpt 1
  board.place(place, {0xBE02, 0x4770});   // bkpt 2, bx lr
  board.handler(tim2, {0x8015, 0x4770});  // strh r5, [r2]; bx lr
  board.core.exceptions.set_enabled(tim2, true);
  board.set(0, place | 1).set(2, place).set(3, 0x2101).set(5, 0x2102).set(6, pend_word).set(7, tim2_bit);
  ASSERT_EQ(board.run(), RunEnd::stopped);
  ASSERT_EQ(board.processor.breakpoint(), 1);
  EXPECT_EQ(board.get(1), 2U) << "movs r1, #2";
}

}  // namespace kmax::virtual_board::processor_test
