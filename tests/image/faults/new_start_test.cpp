// What ends in a new start of the processor. It does not look at the drives' states: the handlers switch both
// bridges off in any, so only armed and disarmed are tried.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <stdexcept>

#include "host_tools/device/crash_words.hpp"
#include "tests/image/faults/fault_bench.hpp"
#include "tests/image/faults/fault_page.hpp"

namespace kmax::tests::new_start_test {

using firmware::Refusal;
using tests::words_for;
using virtual_board::BoardTime;
using Bench = FaultBench;

constexpr std::size_t axes = firmware::axis_count;

struct Upset {
  const char* name;
  std::function<void(Bench&)> make;
  double ticks;  ///< until both bridges are off
  firmware::ResetCause reset;
  const char* crash;  ///< in the words of the crash; "": none is kept
  std::function<void(Bench&)> mend{};
  Refusal refusal = Refusal::none;  ///< of arming after the start, until it is mended
};

void go_on_at(Bench& bench, std::uint32_t address) {
  bench.board->chip().processor().set_core_register(15, address);
}
/// An instruction of the image, behind its vectors, that looks like this.
void go_on_with(Bench& bench, std::uint16_t instruction, std::uint16_t mask = 0xFFFF) {
  const auto flash = bench.board->chip().bus().flash();
  for (std::size_t at = 98 * sizeof(std::uint32_t); at + 1 < flash.size(); at += 2) {
    if (((flash[at] | flash[at + 1] << 8) & mask) == instruction)
      return go_on_at(bench, static_cast<std::uint32_t>(virtual_board::memory_map::flash.base + at));
  }
  throw std::runtime_error("the image does not have the instruction");
}

std::vector<Upset> upsets() {
  using firmware::ResetCause;
  constexpr double handler = 0.1, next_interrupt = 0.6;
  constexpr std::uint32_t stack_pointer = 13;
  return {
      {"reset line pulled", [](Bench& b) { b.board->pull_reset(); }, handler, ResetCause::pin, ""},
      {"power off and on", [](Bench& b) { b.board->cycle_power(); }, handler, ResetCause::power_on, ""},
      // It goes on from the internal oscillator, at full speed.
      {"crystal stops", [](Bench& b) { b.board->chip().peripherals().rcc.fail_crystal(b.board->now()); },
       next_interrupt, ResetCause::software, "exception 2 came, which nobody handles"},
      {"crystal does not start at the next start",
       [](Bench& b) {
         b.board->chip().peripherals().rcc.set_crystal_works(false);
         b.board->pull_reset();
       },
       handler, ResetCause::pin, ""},
      // No power stage on a slow clock, and the axes say that they have no encoder.
      {"PLL does not lock at the next start",
       [](Bench& b) {
         b.board->chip().peripherals().rcc.set_pll_locks(false);
         b.board->pull_reset();
       },
       handler, ResetCause::pin, "",
       [](Bench& b) {
         b.board->chip().peripherals().rcc.set_pll_locks(true);
         b.board->pull_reset();
       },
       Refusal::encoder_invalid},
      {"main loop stands still", [](Bench& b) { go_on_with(b, 0xE7FE); }, 2100,
       ResetCause::independent_watchdog, ""},
      {"interrupt that nobody handles",
       [](Bench& b) {
         constexpr unsigned tim2 = 16 + 28;
         b.board->chip().core().exceptions.set_enabled(tim2, true);
         b.board->chip().core().exceptions.pend(tim2);
       },
       next_interrupt, ResetCause::software, "interrupt 28 came, which nobody handles"},
      {"undefined instruction", [](Bench& b) { go_on_with(b, 0xDE00, 0xFF00); }, handler,
       ResetCause::software, "undefined instruction"},
      {"stack full",
       [](Bench& b) {
         const std::uint32_t bottom = tests::image().required_symbol("kmax_stack_bottom").address;
         b.board->chip().processor().set_core_register(stack_pointer, bottom + 16);
       },
       next_interrupt, ResetCause::software, "stack overflow?"},
      {"jump into RAM", [](Bench& b) { go_on_at(b, 0x2001'8000); }, handler, ResetCause::software,
       "instruction fetch from where no code may be"},
      {"store through a null pointer",
       [](Bench& b) {
         b.board->chip().processor().set_core_register(0, 0);
         go_on_with(b, 0x6001);  // str r1, [r0]
       },
       handler, ResetCause::software, "data access that the memory protection forbids"},
  };
}

const char* words_for(firmware::ResetCause cause) {
  using firmware::ResetCause;
  return cause == ResetCause::pin                    ? "reset line"
         : cause == ResetCause::power_on             ? "power-on"
         : cause == ResetCause::independent_watchdog ? "watchdog"
                                                     : "software";
}

class NewStart : public testing::TestWithParam<std::size_t> {};

TEST_P(NewStart, IsWhatThePageSays) {
  const Upset upset = upsets()[GetParam()];
  virtual_board::VirtualBoardConfig as_on_the_chip;
  as_on_the_chip.processor.faults_to_firmware = true;
  for (const bool armed : {true, false}) {
    Bench bench(as_on_the_chip);
    bench.start();
    bench.begin();
    ASSERT_TRUE(bench.recover());
    for (std::size_t axis = 0; armed && axis < axes; ++axis) ASSERT_TRUE(bench.arm(axis));
    if (armed) bench.press();
    while (!bench.board->chip().processor().sleeping() ||
           bench.board->chip().core().exceptions.active_count() != 0)
      bench.board->run_for(1e-6);
    const auto resets = bench.board->resets();
    const BoardTime begin = bench.board->now();
    upset.make(bench);
    const auto off = [&bench] { return !bench.board->bridge_armed(0) && !bench.board->bridge_armed(1); };
    while (!off() && bench.board->now() < begin + ticks(2 * upset.ticks + 10))
      bench.board->run_until(bench.board->now() + ticks(0.02));
    EXPECT_LE(virtual_board::seconds(bench.board->now() - begin) / tick_s, upset.ticks) << upset.name;
    for (int i = 0; i < 3000 && bench.board->resets() == resets; ++i) {
      EXPECT_TRUE(off()) << upset.name;
      bench.board->run_for(1e-3);
    }
    bench.board->run_for(0.2);
    EXPECT_EQ(bench.board->resets(), resets + 1) << upset.name;
    EXPECT_TRUE(off()) << upset.name;
    EXPECT_EQ(bench.number("info.reset_cause"), static_cast<std::uint32_t>(upset.reset)) << upset.name;
    const std::string crash = device::crash_words(bench.crash());
    EXPECT_EQ(crash.empty(), *upset.crash == '\0') << upset.name << ": " << crash;
    EXPECT_NE(crash.find(upset.crash), std::string::npos) << upset.name << ": " << crash;
    if (upset.mend) {
      bench.begin();
      EXPECT_FALSE(bench.arm(0)) << upset.name;
      EXPECT_EQ(words_for(bench.refusal(0)), words_for(upset.refusal)) << upset.name;
      upset.mend(bench);
      bench.board->run_for(0.2);
    }
    bench.begin();
    ASSERT_TRUE(bench.recover()) << upset.name;
    for (std::size_t axis = 0; axis < axes; ++axis) EXPECT_TRUE(bench.arm(axis)) << upset.name;
    bench.board->run_for(0.02);
    for (std::size_t axis = 0; axis < axes; ++axis)
      EXPECT_TRUE(bench.board->bridge_armed(axis)) << upset.name;
  }
  expect_on_page(upset.name,
                 "| " + std::string(upset.name) + " | " + in_words(upset.ticks) + " | " +
                     words_for(upset.reset) + " | " + upset.crash + " | " +
                     (upset.mend ? words_for(upset.refusal) : "can be armed") + " |\n",
                 end_of_starts);
}

INSTANTIATE_TEST_SUITE_P(Image, NewStart, testing::Range(std::size_t{0}, upsets().size()),
                         [](const auto& tested) { return letters_of(upsets()[tested.param].name); });

TEST(FaultMatrixPage, HasNoStartThatNobodyMeasures) {
  EXPECT_EQ(rows_on_page(end_of_starts), upsets().size());
}

}  // namespace kmax::tests::new_start_test
