#include "drivers/stm32f4/clock_tree.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::clock_tree_test {
namespace {

struct FakeRcc {
  FakeRegister cr, pllcfgr, cfgr, apb1enr;
};
struct FakePwr {
  FakeRegister cr;
};
struct FakeFlash {
  FakeRegister acr;
};

/// RCC as RM0090 describes it, with parts that can be broken. Each illegal step leaves a complaint.
class Chip {
 public:
  bool internal_starts = true;
  bool crystal_starts = true;
  bool pll_locks_on_crystal = true;
  bool pll_locks_on_internal = true;
  bool switch_to_pll_works = true;
  bool switch_to_internal_works = true;
  bool wait_states_stick = true;
  unsigned delay = 3;  // reads of CR until an oscillator that was switched on is ready

  FakeRcc rcc;
  FakePwr pwr;
  FakeFlash flash;
  std::string complaint;

  Chip() {
    rcc.cr.value = 0x0000'0083;  // HSI on and ready, trimming
    rcc.pllcfgr.value = 0x2400'3010;
    rcc.cr.on_read = [this](std::uint32_t stored) { return ready_bits(stored); };
    rcc.cr.on_write = [this](std::uint32_t word) { control_written(word); };
    rcc.pllcfgr.on_write = [this](std::uint32_t) {
      if ((rcc.cr.value & on(24)) != 0) complain("PLLCFGR written while the PLL is on");
    };
    rcc.cfgr.on_write = [this](std::uint32_t word) { switch_written(word); };
    pwr.cr.on_write = [this](std::uint32_t) {
      if ((rcc.apb1enr.value & on(28)) == 0) complain("PWR written while its clock is off");
    };
    flash.acr.on_read = [this](std::uint32_t stored) { return wait_states_stick ? stored : stored & ~7U; };
  }

  ~Chip() { EXPECT_EQ(complaint, ""); }

  /// What a boot loader may leave behind: running from the PLL.
  void run_from_pll() {
    rcc.cr.value = on(0) | on(1) | on(16) | on(17) | on(24) | on(25);
    rcc.pllcfgr.value = 0x0740'5408;
    rcc.cfgr.value = 0x0000'940A;
    crystal_age = pll_age = 1000;
  }

  ClockFrequencies start(ClockWaits waits = {}) {
    return ClockTree<FakeRcc, FakePwr, FakeFlash>{rcc, pwr, flash, waits}.start();
  }

  unsigned source_in_use() const { return (rcc.cfgr.value >> 2) & 3U; }
  std::uint32_t prescalers() const { return rcc.cfgr.value & 0xFFF0U; }
  bool pll_is_on() const { return (rcc.cr.value & on(24)) != 0; }

  static constexpr std::uint32_t on(unsigned bit) { return 1U << bit; }

 private:
  unsigned crystal_age = 0;
  unsigned pll_age = 0;

  void complain(const char* what) { complaint += std::string(what) + "; "; }

  std::uint32_t ready_bits(std::uint32_t stored) {
    std::uint32_t word = stored & ~(on(1) | on(17) | on(25));
    if ((stored & on(0)) != 0 && internal_starts) word |= on(1);
    if ((stored & on(16)) != 0 && crystal_starts && ++crystal_age > delay) word |= on(17);
    const bool from_crystal = (rcc.pllcfgr.value & on(22)) != 0;
    const bool has_input = from_crystal ? (word & on(17)) != 0 : (word & on(1)) != 0;
    const bool locks = from_crystal ? pll_locks_on_crystal : pll_locks_on_internal;
    if ((stored & on(24)) != 0 && has_input && locks && ++pll_age > delay) word |= on(25);
    rcc.cr.value = word;
    return word;
  }

  void control_written(std::uint32_t word) {
    if ((word & on(24)) == 0) {
      pll_age = 0;
      if (source_in_use() == 2) complain("PLL stopped under the core");
    }
    if ((word & on(16)) == 0) crystal_age = 0;
    if ((word & on(0)) == 0 && source_in_use() == 0) complain("HSI stopped under the core");
  }

  void switch_written(std::uint32_t word) {
    const unsigned wanted = word & 3U;
    unsigned status = (word >> 2) & 3U;
    if (wanted == 2 && switch_to_pll_works) {
      if ((rcc.cr.value & on(25)) == 0) complain("switched to a PLL that is not locked");
      if ((flash.acr.value & 7U) < 5) complain("168 MHz with too few wait states");
      if ((pwr.cr.value & on(14)) == 0) complain("168 MHz without voltage scale 1");
      if (((word >> 10) & 7U) != 5) complain("APB1 above 42 MHz");
      if (((word >> 13) & 7U) != 4) complain("APB2 above 84 MHz");
      status = 2;
    }
    if (wanted == 0 && switch_to_internal_works) status = 0;
    if (status == 2 && (((word >> 10) & 7U) != 5 || ((word >> 13) & 7U) != 4))
      complain("bus too fast on the PLL");
    rcc.cfgr.value = (word & ~0xCU) | status << 2;
  }
};

TEST(ClockTree, CrystalGives168MHz) {
  Chip chip;
  const ClockFrequencies clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::crystal_pll);
  EXPECT_EQ(clocks.core_hz, 168'000'000U);
  EXPECT_EQ(clocks.apb1_hz, 42'000'000U);
  EXPECT_EQ(clocks.apb2_hz, 84'000'000U);
  EXPECT_EQ(chip.rcc.pllcfgr.value, 0x0740'2A04U);
  EXPECT_EQ(chip.rcc.cfgr.value, 0x9400U | 0xAU);
  EXPECT_EQ(chip.flash.acr.value, 0x705U);
}

TEST(ClockTree, DeadCrystalFallsBackToInternalPll) {
  Chip chip;
  chip.crystal_starts = false;
  const ClockFrequencies clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::internal_pll);
  EXPECT_EQ(clocks.core_hz, 168'000'000U);
  // 16 MHz / 8 * 168 / 2, from HSI
  EXPECT_EQ(chip.rcc.pllcfgr.value & 0x0043'7FFFU, 168U << 6 | 8U);
  EXPECT_EQ(chip.rcc.cr.value & Chip::on(16), 0U) << "a crystal that does not start is switched off";
}

TEST(ClockTree, PllThatNeverLocksLeavesTheCoreOn16MHz) {
  Chip chip;
  chip.pll_locks_on_crystal = chip.pll_locks_on_internal = false;
  const ClockFrequencies clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::internal);
  EXPECT_EQ(clocks.core_hz, 16'000'000U);
  EXPECT_EQ(clocks.apb1_hz, 16'000'000U);
  EXPECT_EQ(chip.source_in_use(), 0U);
  EXPECT_EQ(chip.prescalers(), 0U);
  EXPECT_FALSE(chip.pll_is_on());
}

TEST(ClockTree, SwitchThatDoesNotHappenLeavesTheCoreOn16MHz) {
  Chip chip;
  chip.switch_to_pll_works = false;
  EXPECT_EQ(chip.start().source, ClockSource::internal);
  EXPECT_EQ(chip.rcc.cfgr.value & 3U, 0U) << "a late switch must not happen behind the program's back";
  EXPECT_EQ(chip.prescalers(), 0U);
  EXPECT_FALSE(chip.pll_is_on());
}

TEST(ClockTree, EachDefectLeavesItsSource) {
  struct Row {
    const char* what;
    void (*make)(Chip&);
    ClockSource source;
  };
  for (const Row& row :
       {Row{"a PLL that locks only on the internal oscillator",
            [](Chip& chip) { chip.pll_locks_on_crystal = false; }, ClockSource::internal_pll},
        Row{"wait states that do not stick forbid full speed",
            [](Chip& chip) { chip.wait_states_stick = false; }, ClockSource::internal},
        Row{"a running PLL is left first", [](Chip& chip) { chip.run_from_pll(); }, ClockSource::crystal_pll},
        Row{"a clock control that reads zero",
            [](Chip& chip) { chip.rcc.cr.on_read = [](std::uint32_t) { return 0U; }; },
            ClockSource::unresponsive},
        Row{"an internal oscillator that cannot be reached: the PLL under the core must not be stopped",
            [](Chip& chip) {
              chip.run_from_pll();
              chip.switch_to_internal_works = false;
            },
            ClockSource::unresponsive}}) {
    SCOPED_TRACE(row.what);
    Chip chip;
    row.make(chip);
    EXPECT_EQ(chip.start().source, row.source);
  }
}

TEST(ClockTree, WaitBoundsAreRespectedExactly) {
  Chip chip;
  chip.crystal_starts = chip.pll_locks_on_internal = false;
  const ClockWaits waits{.crystal = 500, .pll = 70, .other = 9};
  EXPECT_EQ(chip.start(waits).source, ClockSource::internal);
  // 500 for the crystal, 70 for the PLL; what is ready at once and the read-modify-writes add a handful.
  EXPECT_GE(chip.rcc.cr.reads, 570U);
  EXPECT_LE(chip.rcc.cr.reads, 570U + 20U);
}

TEST(ClockTree, CrystalThatIsReadyAtTheLastPollCounts) {
  const ClockWaits waits{.crystal = 50, .pll = 200, .other = 9};
  Chip just_in_time;
  just_in_time.delay = 49;
  EXPECT_EQ(just_in_time.start(waits).source, ClockSource::crystal_pll);
  Chip too_late;
  too_late.delay = 50;
  EXPECT_NE(too_late.start(waits).source, ClockSource::crystal_pll);
}

RC_GTEST_PROP(ClockTree, EveryMixOfDefectsEndsWithAnHonestResult,
              (bool internal, bool crystal, bool lock_crystal, bool lock_internal, bool to_pll,
               bool to_internal, bool latency, bool boot_loader)) {
  Chip chip;
  if (boot_loader) chip.run_from_pll();
  chip.internal_starts = internal;
  chip.crystal_starts = crystal;
  chip.pll_locks_on_crystal = lock_crystal;
  chip.pll_locks_on_internal = lock_internal;
  chip.switch_to_pll_works = to_pll;
  chip.switch_to_internal_works = to_internal;
  chip.wait_states_stick = latency;
  const ClockWaits waits{.crystal = 100, .pll = 100, .other = 100};
  const ClockFrequencies clocks = chip.start(waits);
  RC_ASSERT(chip.rcc.cr.reads + chip.rcc.cfgr.reads + chip.flash.acr.reads < 1200U);
  const bool full = clocks.core_hz == 168'000'000;
  if (clocks.source != ClockSource::unresponsive) RC_ASSERT(full == (chip.source_in_use() == 2));
  if (clocks.source == ClockSource::crystal_pll) RC_ASSERT((chip.rcc.pllcfgr.value >> 22 & 1U) == 1U);
  if (clocks.source == ClockSource::internal_pll) RC_ASSERT((chip.rcc.pllcfgr.value >> 22 & 1U) == 0U);
}

}  // namespace
}  // namespace kmax::drivers::stm32f4::clock_tree_test
