// What the memory protection of the flashed image catches, with both axes armed: the bridges are off at once
// and the record says what it was. Each case is tried without the protection as well: it is what makes the
// difference.
#include <gtest/gtest.h>

#include <cstddef>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/device/crash_words.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests::memory_guard_test {

namespace cortex = drivers::cortex_m;
using virtual_board::VirtualBoard;

struct Mishap {
  const char* name;
  /// An instruction somewhere in the application, which is run next with the registers below.
  std::uint16_t instruction;
  std::uint32_t program_counter;  ///< instead of `instruction`; 0: none
  std::uint32_t r0, stack_pointer;
  std::uint32_t status;   ///< CFSR
  std::uint32_t address;  ///< 0: none
  const char* words;
  /// Without the protection: the words of the BusFault, "" if nothing notices, null if the access is done.
  const char* unguarded;
};

constexpr std::uint32_t stored = 0xC0DE;
constexpr std::uint16_t push_r4_to_lr = 0xB570, store_r1_at_r0 = 0x6001, load_r1_from_r0 = 0x6801;
constexpr std::uint32_t bottom = 0x1000'0000, somewhere = bottom + 0x1000;
/// Behind the tick's code, in what is reserved for it: where it is fetched, and where the same memory lies as
/// data.
constexpr std::uint32_t tick_code = 0xF000, tick_code_as_data = 0x2000'F000;
constexpr std::uint32_t data =
    cortex::scb_cfsr::DataViolation::mask | cortex::scb_cfsr::MemoryFaultAddressValid::mask;
constexpr std::uint32_t stacking = cortex::scb_cfsr::MemoryFaultStacking::mask;
constexpr std::uint32_t fetch = cortex::scb_cfsr::FetchViolation::mask;

const Mishap mishaps[] = {
    {"PushPastTheStack", push_r4_to_lr, 0, 0, bottom + 8, data | stacking, bottom - 8,
     "data access that the memory protection forbids", "bus error"},
    {"InterruptPastTheStack", 0, 0, 0, bottom + 16, stacking, 0, "stack overflow?", "bus error"},
    {"StoreThroughNull", store_r1_at_r0, 0, 0, somewhere, data, 0,
     "data access that the memory protection forbids at address 0x00000000", "bus error"},
    {"LoadThroughNull", load_r1_from_r0, 0, 0, somewhere, data, 0,
     "data access that the memory protection forbids at address 0x00000000", nullptr},
    {"StoreToCode", store_r1_at_r0, 0, 0x0800'C000, somewhere, data, 0x0800'C000,
     "data access that the memory protection forbids at address 0x0800C000", "bus error"},
    {"StoreToTheTicksCode", store_r1_at_r0, 0, tick_code, somewhere, data, tick_code,
     "data access that the memory protection forbids at address 0x0000F000", "bus error"},
    {"StoreToTheTicksCodeAsData", store_r1_at_r0, 0, tick_code_as_data, somewhere, data, tick_code_as_data,
     "data access that the memory protection forbids at address 0x2000F000", nullptr},
    {"JumpIntoRam", 0, 0x2001'8000, 0, somewhere, fetch, 0, "instruction fetch from where no code may be",
     ""},
};

class MemoryGuard : public testing::TestWithParam<Mishap> {
 protected:
  MemoryGuard()
      : bench({{"axis0.wall.position", -1.0}, {"axis1.wall.position", -1.0}}, 1.0, "motor_axes",
              as_on_the_chip()) {
    bench.start();
    EXPECT_EQ(tests::image().required_symbol("kmax_stack_bottom").address, bottom);
    for (const std::size_t axis : {0U, 1U}) {
      bench.master->arm(axis);
      EXPECT_TRUE(bench.board->bridge_armed(axis));
    }
    // An endless loop, should it ever be reached.
    bench.board->chip().bus().store(0x2001'8000, 0xE7FE'E7FE);
  }

  static virtual_board::VirtualBoardConfig as_on_the_chip() {
    virtual_board::VirtualBoardConfig config;
    config.processor.faults_to_firmware = true;
    return config;
  }

  std::uint32_t address_of(std::uint16_t instruction) {
    const auto flash = bench.board->chip().bus().flash();
    for (std::size_t at = 0xC000; at + 1 < flash.size(); at += 2) {
      if ((flash[at] | flash[at + 1] << 8) == instruction)
        return static_cast<std::uint32_t>(0x0800'0000 + at);
    }
    throw std::runtime_error("the image does not have the instruction");
  }

  /// s from the mishap until both bridges were off; negative: they never were within 100 us.
  double happen() {
    VirtualBoard& board = *bench.board;
    const Mishap& mishap = GetParam();
    // In the main loop: asleep, with interrupts that wait for the core to wake; or where one may come, if
    // what is run next would not let it.
    const bool asleep = mishap.program_counter == 0;
    while (board.chip().core().exceptions.active_count() != 0 ||
           (asleep ? !board.chip().processor().sleeping() : board.chip().processor().masks().primask))
      board.run_for(1e-6);
    board.chip().processor().set_core_register(13, mishap.stack_pointer);
    board.chip().processor().set_core_register(0, mishap.r0);
    board.chip().processor().set_core_register(1, stored);
    std::uint32_t next = mishap.program_counter;
    if (mishap.instruction != 0) next = address_of(mishap.instruction);
    if (next != 0) board.chip().processor().set_core_register(15, next);
    const auto begin = board.now();
    while (board.now() < begin + ticks(2)) {
      board.run_for(0.1e-6);
      if (!board.bridge_armed(0) && !board.bridge_armed(1))
        return virtual_board::seconds(board.now() - begin);
    }
    return -1.0;
  }

  ImageBench bench;
};

TEST_P(MemoryGuard, TurnsAMishapIntoANamedFault) {
  const Mishap& mishap = GetParam();
  const double off = happen();
  // The next interrupt, at most half a tick away, is what finds a stack that has no room for a frame.
  EXPECT_GE(off, 0.0) << "the bridges are still on";
  EXPECT_LT(off, mishap.instruction != 0 || mishap.program_counter != 0 ? 3e-6 : 0.5 * tick_s + 3e-6);
  bench.board->run_for(1e-3);
  bench.start();
  EXPECT_EQ(bench.board->resets(), 2U);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  EXPECT_FALSE(bench.board->bridge_armed(1));
  const firmware::CrashRecord record = bench.crash();
  EXPECT_EQ(record.count, 1U);
  EXPECT_EQ(record.cause, firmware::CrashCause::fault);
  EXPECT_EQ(record.exception_number, 3U);
  EXPECT_EQ(record.status, mishap.status);
  EXPECT_EQ(record.hard_fault_status, cortex::scb_hfsr::Forced::mask);
  EXPECT_EQ(record.address, mishap.address);
  EXPECT_NE(device::crash_words(record).find(mishap.words), std::string::npos) << device::crash_words(record);
}

TEST_P(MemoryGuard, IsWhatCatchesIt) {
  const Mishap& mishap = GetParam();
  bench.board->chip().core().memory_protection.write(
      {offsetof(cortex::MpuRegisters, ctrl), 4, bench.board->now()}, 0);
  const auto before = bench.board->chip().bus().load(mishap.r0);
  const double off = happen();
  if (mishap.unguarded == nullptr) {
    if (mishap.instruction == store_r1_at_r0) {
      EXPECT_NE(bench.board->chip().bus().load(mishap.r0), before)
          << "what follows in the image may change it again";
    }
    // What runs behind the access may fail, at another address.
    const auto of_the_core = [this](std::uint32_t offset) {
      return bench.board->chip().core().system_control.read({offset, 4, bench.board->now()});
    };
    const bool refused = (of_the_core(offsetof(cortex::ScbRegisters, cfsr)) &
                          cortex::scb_cfsr::BusFaultAddressValid::mask) != 0 &&
                         of_the_core(offsetof(cortex::ScbRegisters, bfar)) == mishap.r0;
    EXPECT_FALSE(refused);
    return;
  }
  if (*mishap.unguarded == '\0') {
    EXPECT_LT(off, 0.0) << "nothing notices";
    return;
  }
  bench.board->run_for(1e-3);
  bench.start();
  const firmware::CrashRecord record = bench.crash();
  EXPECT_EQ(record.status & 0xFFU, 0U) << "no fault of the memory protection";
  EXPECT_NE(device::crash_words(record).find(mishap.unguarded), std::string::npos)
      << device::crash_words(record);
}

INSTANTIATE_TEST_SUITE_P(Image, MemoryGuard, testing::ValuesIn(mishaps),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace kmax::tests::memory_guard_test
