// What stops a run, in words that lead to the instruction; and the same as faults of the chip, when asked
// for.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/cortex_m/program_on_core.hpp"

namespace kmax::virtual_board::processor_faults_test {

using drivers::stm32f4::Interrupt;

constexpr unsigned tim2 = exception_number::first_interrupt + static_cast<unsigned>(Interrupt::tim2);
const ProcessorConfig as_on_the_chip{.units_per_instruction = 0, .faults_to_firmware = true};

const Program load{0xBF00,   // nop
                   0x6841,   // ldr r1, [r0, #4]
                   0x3201,   // adds r2, #1
                   0xBE01};  // bkpt 1
const Program store{0xBF00,  // nop
                    0x6041,  // str r1, [r0, #4]
                    0x3201,  // adds r2, #1
                    0xBE01};

void expect_fault(ProgramOnCore& board, std::initializer_list<const char*> parts) {
  ASSERT_EQ(board.run(), RunEnd::fault);
  for (const char* part : parts) {
    EXPECT_NE(board.processor.fault().find(part), std::string::npos)
        << part << " is not in: " << board.processor.fault();
  }
  EXPECT_EQ(board.run(2 * units_per_second), RunEnd::fault) << "only a reset helps";
}

std::uint32_t scb(ProgramOnCore& board, std::size_t offset) {
  return board.core.system_control.read({static_cast<std::uint32_t>(offset), 4, 0});
}

TEST(ProcessorFault, NamesTheStoreThatHasNoRegisterBlock) {
  ProgramOnCore board({0x6001,          // str r1, [r0, #0]
                       0x6041,          // str r1, [r0, #4]
                       0x7241,          // strb r1, [r0, #9]
                       0xF8C0, 0x1400,  // str.w r1, [r0, #1024]: the first one behind the block
                       0x60C1,          // str r1, [r0, #12]
                       0xBE01});
  board.processor.name_functions_by([](std::uint32_t pc) { return pc == 0x0800'0206 ? "culprit+0x6" : ""; });
  board.set(0, ProgramOnCore::block_base).set(1, 0x1234'5678);
  expect_fault(board,
               {"store", "0x12345678", "4 bytes", "0x40000400", "pc 0x08000206", "culprit+0x6", "nothing"});
  ASSERT_EQ(board.block.records.size(), 3U) << "what follows in the block must not reach the registers";
  EXPECT_EQ(board.block.records[2].bytes, 1U);
  EXPECT_EQ(board.block.records[2].offset, 9U);
  EXPECT_EQ(board.block.records[2].value, 0x78U);
}

TEST(ProcessorFault, NamesTheBlockThatRefusesAndItsReason) {
  ProgramOnCore board(load);
  board.set(0, ProgramOnCore::block_base);
  board.block.on_read = [](const Access& access) -> std::uint32_t {
    refuse(access, "BLOCK", "no such register");
  };
  expect_fault(board, {"load", "0x40000004", "(BLOCK)", "pc 0x08000202", "no such register"});
}

TEST(ProcessorFault, NamesTheClockThatIsOff) {
  ProgramOnCore board(load);
  board.set(0, ProgramOnCore::block_base);
  board.clocked = false;
  expect_fault(board, {"0x40000004", "BLOCK", "clock is off"});
  EXPECT_TRUE(board.block.records.empty());
}

TEST(ProcessorFault, StopsAtUnalignedRegisterAccesses) {
  ProgramOnCore board(load);
  board.set(0, ProgramOnCore::block_base + 2);
  expect_fault(board, {"0x4000000", "aligned"});
}

TEST(ProcessorFault, StopsWhereThereIsNoMemory) {
  for (const std::uint32_t address :
       {0x2002'0000U, 0x1001'0000U, 0x0810'0000U, 0x2200'0000U, 0x4200'0000U, 0x6000'0000U}) {
    ProgramOnCore board(load);
    board.set(0, address).set(2, 0);
    expect_fault(board, {"load", "pc 0x08000202"});
    EXPECT_EQ(board.get(2), 0U);
  }
  ProgramOnCore board(store);
  board.set(0, 0x2001'FFFC).set(1, 0xABCD);
  expect_fault(board, {"store of 0x0000ABCD", "0x20020000", "pc 0x08000202"});
}

TEST(ProcessorFault, StopsAtStoresToFlashButHandsOutThoseToTheParameterSectors) {
  ProgramOnCore refused(store);
  refused.set(0, 0x0800'C000);
  expect_fault(refused, {"0x0800C004", "flash", "pc 0x08000202"});

  // Of a page that the engine knows already: the program's own, and one that was loaded from.
  ProgramOnCore own(store);
  own.set(0, 0x0800'0300 - 4).set(1, 0x1234'5678);
  expect_fault(own, {"0x08000300", "flash", "pc 0x08000202"});
  EXPECT_NE(own.bus.load(0x0800'0300), 0x1234'5678U);
  ProgramOnCore loaded({0x6842,    // ldr r2, [r0, #4]
                        0x6041,    // str r1, [r0, #4]
                        0xBE01});  // bkpt 1
  loaded.set(0, 0x0800'C000).set(1, 0x1234'5678);
  expect_fault(loaded, {"0x0800C004", "flash", "pc 0x08000202"});
  EXPECT_NE(loaded.bus.load(0x0800'C004), 0x1234'5678U);

  ProgramOnCore without(store);
  without.set(0, 0x0800'4000);
  expect_fault(without, {"0x08004004", "parameter"});

  ProgramOnCore board(store);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stores;
  board.bus.on_parameter_store([&](std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime) {
    EXPECT_EQ(bytes, 4U);
    stores.emplace_back(address, value);
  });
  board.set(0, 0x0800'BFF8).set(1, 77);
  EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  const decltype(stores) expected{{0x0800'BFFC, 77}};
  EXPECT_EQ(stores, expected);
  EXPECT_EQ(board.bus.load(0x0800'BFFC), 0xFFFF'FFFFU) << "the store alone changes nothing";
}

TEST(ProcessorFault, ReadsTheParameterSectors) {
  ProgramOnCore board(load);
  board.bus.memory(0x0800'8004, 4)[1] = 0x12;
  board.set(0, 0x0800'8000);
  EXPECT_EQ(board.run(), RunEnd::stopped);
  EXPECT_EQ(board.get(1), 0xFFFF'12FFU);
}

TEST(ProcessorFault, FetchesCodeFromFlashAndSramOnly) {
  const Program jump{0x4700};  // bx r0
  for (const std::uint32_t address : {0x1000'0001U, 0x0000'0001U, 0x0800'4001U, 0x4000'0001U, 0x2002'0001U}) {
    ProgramOnCore board(jump);
    board.set(0, address);
    expect_fault(board, {});
    EXPECT_NE(board.processor.fault().find("fetch"), std::string::npos)
        << std::hex << address << board.processor.fault();
  }
  ProgramOnCore board(jump);
  board.place(0x2000'0100, {0xBE05});
  board.set(0, 0x2000'0101);
  EXPECT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.processor.breakpoint(), 5);
}

TEST(ProcessorFault, FindsFloatingPointInstructionsBeforeCpacr_FloatingPointUnit) {
  const Program fp{0xBF00,          // nop
                   0xEE00, 0x0A10,  // vmov s0, r0
                   0xEE10, 0x0A10,  // vmov r0, s0
                   0xBE01};
  ProgramOnCore board(fp);
  expect_fault(board, {"floating-point", "pc 0x08000202", "CPACR"});
  ProgramOnCore enabled(fp);
  enabled.core.system_control.write({offsetof(drivers::cortex_m::ScbRegisters, cpacr), 4, 0}, 0xFU << 20);
  EXPECT_EQ(enabled.run(), RunEnd::stopped) << enabled.processor.fault();
}

TEST(ProcessorFault, StopsAtUndefinedInstructions) {
  ProgramOnCore board({0xBF00, 0xDE03});  // nop; udf #3
  expect_fault(board, {"undefined instruction", "pc 0x08000202"});
}

TEST(ProcessorFault, StopsWhenTheFrameDoesNotFitIntoMemory) {
  // The latter is SRAM where it is fetched from, to which nothing is stored.
  for (const std::uint32_t stack_pointer : {0x2000'0010U, 0x0000'1000U}) {
    ProgramOnCore board({0xBF30, 0xBE01});
    board.bus.show_sram_at_zero(true);
    board.core.exceptions.set_enabled(tim2, true);
    board.handler(tim2, {0x4770});
    board.set(13, stack_pointer);
    board.core.exceptions.pend(tim2);
    const std::string place = fmt::format("stack pointer 0x{:08X}", stack_pointer);
    expect_fault(board, {place.c_str(), "outside RAM"});
  }
}

TEST(ProcessorFault, StopsAtABrokenVectorOrReturn) {
  ProgramOnCore even({0xBF30, 0xBE01});
  even.core.exceptions.set_enabled(tim2, true);
  even.vector(tim2, 0x0800'1000);
  even.core.exceptions.pend(tim2);
  expect_fault(even, {"vector", "0x08001000"});

  ProgramOnCore overwritten({0xBF30, 0xBE01});
  overwritten.core.exceptions.set_enabled(tim2, true);
  overwritten.handler(tim2, {0x2000,    // movs r0, #0
                             0x9007,    // str r0, [sp, #28]: xPSR
                             0x4770});  // bx lr
  overwritten.core.exceptions.pend(tim2);
  expect_fault(overwritten, {"xPSR", "stack overwritten"});
}

TEST(ProcessorFault, RefusesUnprivilegedCodeWhenItIsInterrupted) {
  ProgramOnCore board({0x2201,          // movs r2, #1
                       0xF382, 0x8814,  // msr control, r2
                       0xF3BF, 0x8F6F,  // isb
                       0xE7FE});        // b here
  board.core.exceptions.set_enabled(tim2, true);
  board.handler(tim2, {0x4770});
  EXPECT_EQ(board.run(1000), RunEnd::time_reached);
  board.core.exceptions.pend(tim2);
  expect_fault(board, {"nPRIV"});
}

TEST(ProcessorFault, BecomesHardFaultWithTheInstructionsAddress_FaultEscalation) {
  ProgramOnCore board(load, as_on_the_chip);
  board.handler(exception_number::hard_fault, {0xBE09});
  board.set(0, 0x2002'0000).set(2, 0);
  ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.processor.breakpoint(), 9);
  EXPECT_EQ(board.bus.load(board.get(13) + 24), ProgramOnCore::program_base + 2);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, hfsr)),
            drivers::cortex_m::scb_hfsr::Forced::mask);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, cfsr)),
            drivers::cortex_m::scb_cfsr::PreciseBusFault::mask |
                drivers::cortex_m::scb_cfsr::BusFaultAddressValid::mask);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, bfar)), 0x2002'0004U);
}

TEST(ProcessorFault, BecomesBusFaultWhenThatIsEnabled_BusFault) {
  ProgramOnCore board(load, as_on_the_chip);
  board.handler(exception_number::bus_fault, {0xBE08});
  board.core.system_control.write({offsetof(drivers::cortex_m::ScbRegisters, shcsr), 4, 0},
                                  drivers::cortex_m::scb_shcsr::BusFaultEnable::mask);
  board.set(0, ProgramOnCore::block_base + 0x400);
  ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.processor.breakpoint(), 8);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, cfsr)),
            drivers::cortex_m::scb_cfsr::ImpreciseBusFault::mask);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, hfsr)), 0U);
}

TEST(ProcessorFault, BecomesUsageFaultOfAnUndefinedInstruction_UsageFault) {
  ProgramOnCore board({0xBF00, 0xDE03}, as_on_the_chip);
  board.handler(exception_number::hard_fault, {0xBE09});
  ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.bus.load(board.get(13) + 24), ProgramOnCore::program_base + 2);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, cfsr)),
            drivers::cortex_m::scb_cfsr::UndefinedInstruction::mask);
}

TEST(ProcessorFault, LocksUpOnAFaultInTheHardFaultHandler_Lockup) {
  ProgramOnCore board(load, as_on_the_chip);
  board.handler(exception_number::hard_fault, load);
  board.set(0, 0x2002'0000);
  expect_fault(board, {"lock-up", "0x20020004"});
}

TEST(ProcessorFault, LockedUpItStandsUntilAReset_Lockup) {
  ProcessorConfig config = as_on_the_chip;
  config.locks_up = true;
  ProgramOnCore board(load, config);
  board.handler(exception_number::hard_fault, load);
  board.set(0, 0x2002'0000);
  EXPECT_EQ(board.processor.run_until(1'000'000), RunEnd::time_reached);
  EXPECT_TRUE(board.processor.locked_up());
  EXPECT_EQ(board.processor.now(), 1'000'000U);
  const auto instructions = board.processor.instructions();
  EXPECT_EQ(board.processor.run_until(2'000'000), RunEnd::time_reached);
  EXPECT_EQ(board.processor.instructions(), instructions);
  board.processor.reset(board.processor.now());
  EXPECT_FALSE(board.processor.locked_up());
}

/// A core whose unit lets privileged code do all but what the regions say.
struct Guarded : ProgramOnCore {
  Guarded(const Program& program, const std::vector<MemoryProtection::Region>& regions,
          ProcessorConfig config = as_on_the_chip)
      : ProgramOnCore(program, config) {
    handler(exception_number::hard_fault, {0xBE09});
    using namespace drivers::cortex_m;
    for (std::uint32_t number = 0; number < regions.size(); ++number) {
      unit(offsetof(MpuRegisters, rnr), number);
      unit(offsetof(MpuRegisters, rbar), regions[number].address);
      unit(offsetof(MpuRegisters, rasr), regions[number].attributes | mpu_rasr::Enable::mask);
    }
    unit(offsetof(MpuRegisters, ctrl), mpu_ctrl::Enable::mask | mpu_ctrl::PrivilegedDefault::mask);
  }
  void unit(std::size_t offset, std::uint32_t value) {
    core.memory_protection.write({static_cast<std::uint32_t>(offset), 4, 0}, value);
  }
  /// Ends in the HardFault handler, with this in CFSR, at `pc` by the frame.
  void expect_violation(std::uint32_t status, std::uint32_t address, std::uint32_t pc) {
    ASSERT_EQ(run(), RunEnd::stopped) << processor.fault();
    EXPECT_EQ(processor.breakpoint(), 9);
    EXPECT_EQ(scb(*this, offsetof(drivers::cortex_m::ScbRegisters, cfsr)), status);
    if (address != 0) {
      EXPECT_EQ(scb(*this, offsetof(drivers::cortex_m::ScbRegisters, mmfar)), address);
    }
    EXPECT_EQ(bus.load(get(13) + 24), pc);
  }
};

constexpr std::uint32_t of_size(unsigned log2, std::uint32_t permission, bool code = true) {
  using namespace drivers::cortex_m;
  return mpu_rasr::Size::bits(log2 - 1) | mpu_rasr::Permission::bits(permission) |
         (code ? 0U : mpu_rasr::ExecuteNever::mask);
}
constexpr std::uint32_t data_violation = drivers::cortex_m::scb_cfsr::DataViolation::mask |
                                         drivers::cortex_m::scb_cfsr::MemoryFaultAddressValid::mask;

TEST(MemoryProtectionInForce, ForbidsLoadsAndStoresInMemory_DaccViol) {
  constexpr std::uint32_t page = 0x2000'4000;
  Guarded loading(load, {{page, of_size(10, 0)}});
  loading.set(0, page).set(2, 0);
  loading.expect_violation(data_violation, page + 4, ProgramOnCore::program_base + 2);
  EXPECT_EQ(loading.get(2), 0U);

  Guarded storing(store, {{page, of_size(10, 5)}});
  storing.set(0, page).set(1, 0xABCD).set(2, 0);
  const auto before = storing.bus.load(page + 4);
  storing.expect_violation(data_violation, page + 4, ProgramOnCore::program_base + 2);
  EXPECT_EQ(storing.bus.load(page + 4), before);

  Guarded reading(load, {{page, of_size(10, 5)}});
  reading.set(0, page);
  ASSERT_EQ(reading.run(), RunEnd::stopped);
  EXPECT_EQ(reading.processor.breakpoint(), 1) << "read-only may be read";
  Guarded beside(store, {{page, of_size(10, 0)}});
  beside.set(0, page - 8).set(1, 0xABCD);
  ASSERT_EQ(beside.run(), RunEnd::stopped);
  EXPECT_EQ(beside.processor.breakpoint(), 1) << "the word in front of the region";
  EXPECT_EQ(beside.bus.load(page - 4), 0xABCDU);
}

TEST(MemoryProtectionInForce, ForbidsRegistersAndLetsNothingOfTheBlockReachThem_DaccViol) {
  Guarded board({0xBF00,   // nop
                 0x6041,   // str r1, [r0, #4]
                 0x6081,   // str r1, [r0, #8]
                 0xBE01},  // bkpt 1
                {{ProgramOnCore::block_base, of_size(10, 5)}});
  board.set(0, ProgramOnCore::block_base).set(1, 7);
  board.expect_violation(data_violation, ProgramOnCore::block_base + 4, ProgramOnCore::program_base + 2);
  EXPECT_TRUE(board.block.records.empty());
}

TEST(MemoryProtectionInForce, ForbidsWhereThereIsNothing_DaccViol) {
  Guarded board(load, {{0, of_size(27, 0)}});
  board.set(0, 0);
  board.expect_violation(data_violation, 4, ProgramOnCore::program_base + 2);
}

TEST(MemoryProtectionInForce, ForbidsCodeAlsoWhereItHasRunBefore_IaccViol) {
  constexpr std::uint32_t code = 0x2000'4000;
  Guarded board({0x4780,          // blx r0
                 0x6011,          // str r1, [r2]: switches the unit on
                 0xF3BF, 0x8F6F,  // isb
                 0x4780,          // blx r0
                 0xBE01},
                {{code, of_size(10, 3, false)}});
  using namespace drivers::cortex_m;
  board.unit(offsetof(MpuRegisters, ctrl), 0);
  board.place(code, {0x3301, 0x4770});  // adds r3, #1; bx lr
  board.set(0, code | 1).set(2, mpu_base + 4).set(3, 0);
  board.set(1, mpu_ctrl::Enable::mask | mpu_ctrl::PrivilegedDefault::mask);
  board.expect_violation(scb_cfsr::FetchViolation::mask, 0, code);
  EXPECT_EQ(board.get(3), 1U) << "the first call, before the unit was on";
}

TEST(MemoryProtectionInForce, TheLaterRegionHoldsAndEighthsCanBeLeftOut_Srd) {
  constexpr std::uint32_t base = 0x2000'8000;
  using namespace drivers::cortex_m;
  const std::vector<MemoryProtection::Region> regions{
      {base, of_size(13, 0)}, {base, of_size(13, 3) | mpu_rasr::SubregionDisable::bits(0b1111'1101)}};
  Guarded second(load, regions);
  second.set(0, base + 0x400);
  ASSERT_EQ(second.run(), RunEnd::stopped);
  EXPECT_EQ(second.processor.breakpoint(), 1);
  Guarded first(load, regions);
  first.set(0, base);
  first.expect_violation(data_violation, base + 4, ProgramOnCore::program_base + 2);
}

TEST(MemoryProtectionInForce, EntersTheFaultHandlerWithoutAFrame_MstkErr) {
  constexpr std::uint32_t page = 0x2000'4000;
  Guarded board({0xBF30, 0xBE01}, {{page, of_size(10, 0)}});
  board.core.exceptions.set_enabled(tim2, true);
  board.handler(tim2, {0xBE07});
  board.set(13, page + 0x410);
  board.core.exceptions.pend(tim2);
  ASSERT_EQ(board.run(), RunEnd::stopped) << board.processor.fault();
  EXPECT_EQ(board.processor.breakpoint(), 9);
  EXPECT_EQ(scb(board, offsetof(drivers::cortex_m::ScbRegisters, cfsr)),
            drivers::cortex_m::scb_cfsr::MemoryFaultStacking::mask);
  EXPECT_EQ(board.get(13), page + 0x3F0);
  EXPECT_TRUE(board.core.exceptions.pending(tim2));
}

TEST(MemoryProtectionInForce, IsOffInTheFaultHandlerAndAfterAReset_Hfnmiena) {
  constexpr std::uint32_t page = 0x2000'4000;
  using namespace drivers::cortex_m;
  for (const bool in_fault_handlers : {false, true}) {
    Guarded board(load, {{page, of_size(10, 0)}});
    board.handler(exception_number::hard_fault, {0x6841, 0xBE09});  // ldr r1, [r0, #4]
    if (in_fault_handlers) {
      board.unit(offsetof(MpuRegisters, ctrl), mpu_ctrl::Enable::mask | mpu_ctrl::PrivilegedDefault::mask |
                                                   mpu_ctrl::InFaultHandlers::mask);
    }
    board.set(0, page);
    EXPECT_EQ(board.run(), in_fault_handlers ? RunEnd::fault : RunEnd::stopped)
        << "a second violation locks up";
    board.processor.reset(board.processor.now());
    board.set(0, page);
    EXPECT_EQ(board.run(2 * units_per_second), RunEnd::stopped) << board.processor.fault();
    EXPECT_EQ(board.processor.breakpoint(), 1);
  }
}

TEST(MemoryProtectionInForce, StopsTheRunWithThePlaceUnlessFaultsAreTheFirmwares) {
  constexpr std::uint32_t page = 0x2000'4000;
  Guarded board(store, {{page, of_size(10, 5)}}, {});
  board.set(0, page).set(1, 1);
  expect_fault(board, {"store", "0x20004004", "pc 0x08000202", "memory protection"});
}

TEST(MemoryProtectionInForce, RefusesBordersFinerThanAPage) {
  using namespace drivers::cortex_m;
  EXPECT_THROW(Guarded(load, {{0x2000'0000, of_size(5, 0)}}), RefusedAccess);
  EXPECT_THROW(Guarded(load, {{0x2000'0000, of_size(12, 0) | mpu_rasr::SubregionDisable::bits(1)}}),
               RefusedAccess);
  EXPECT_NO_THROW(Guarded(load, {{0x6000'0000, of_size(5, 0)}})) << "where there is no memory";
  EXPECT_THROW(Guarded(load, {{0x2000'0000, of_size(10, 4)}}), RefusedAccess) << "reserved permission";
  EXPECT_THROW(Guarded(load, {{0, of_size(7, 0) | mpu_rasr::SubregionDisable::bits(1)}}), RefusedAccess);
}

}  // namespace kmax::virtual_board::processor_faults_test
