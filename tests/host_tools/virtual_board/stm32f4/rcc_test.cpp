#include "host_tools/virtual_board/stm32f4/rcc.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "drivers/stm32f4/clock_tree.hpp"
#include "tests/host_tools/virtual_board/stm32f4/system_on_model.hpp"

// RM0090, chapters Reset and clock control for STM32F405xx (RCC) and Power controller (PWR).

namespace kmax::virtual_board::rcc_test {

namespace stm32 = drivers::stm32f4;
namespace cr = stm32::rcc_cr;
namespace cfgr = stm32::rcc_cfgr;
namespace pllcfgr = stm32::rcc_pllcfgr;
using stm32::RccRegisters;
using stm32::ResetCause;
using testing::RegisterOnModel;

constexpr std::uint32_t full_speed_buses = cfgr::Apb1Prescaler::bits(5) | cfgr::Apb2Prescaler::bits(4);
constexpr std::uint32_t divider_4_from_crystal = 0x0740'2A04;  // M 4, N 168, P 2, Q 7

struct Chip : testing::SystemOnModel {
  std::uint32_t get(std::size_t offset) {
    return static_cast<std::uint32_t>(RegisterOnModel(*this, rcc, offset));
  }
  void put(std::size_t offset, std::uint32_t word) { RegisterOnModel(*this, rcc, offset) = word; }
  void set(std::size_t offset, std::uint32_t bits) { put(offset, get(offset) | bits); }

  /// The message of the refusal, "" when the write is accepted.
  std::string refusal(std::size_t offset, std::uint32_t word) {
    try {
      put(offset, word);
    } catch (const RefusedAccess& refused) {
      return refused.what();
    }
    return {};
  }
  void start_crystal() {
    set(offsetof(RccRegisters, cr), cr::CrystalOn::mask);
    run(RccModel::crystal_start_time);
  }
  void start_pll(std::uint32_t setting) {
    put(offsetof(RccRegisters, pllcfgr), setting);
    set(offsetof(RccRegisters, cr), cr::PllOn::mask);
    run(RccModel::pll_lock_time);
  }
  void run_at_168_mhz() {
    power_registers.cr = stm32::pwr_cr::VoltageScale1::mask;
    flash_registers.acr = 5;
    start_crystal();
    start_pll(divider_4_from_crystal);
    put(offsetof(RccRegisters, cfgr), full_speed_buses | cfgr::Switch::bits(cfgr::pll));
    run(RccModel::switch_time);
  }
  std::uint32_t source() { return cfgr::SwitchStatus::of(get(offsetof(RccRegisters, cfgr))); }
};

TEST(RccRegisterMap, ResetValues) {
  Chip chip;
  EXPECT_EQ(chip.get(offsetof(RccRegisters, cr)), 0x0000'0083U);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, pllcfgr)), 0x2400'3010U);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, cfgr)), 0U);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, ahb1enr)), 0x0010'0000U);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, apb1enr)), 0U);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, csr)), 0x0E00'0000U);
  EXPECT_THROW(chip.get(0x50), RefusedAccess) << "AHB1LPENR";
  EXPECT_THROW(chip.read(0, 2), RefusedAccess);
}

TEST(RccClocks, CrystalIsReadyNeitherEarlyNorLate) {
  Chip chip;
  chip.access_time = 0;
  chip.set(offsetof(RccRegisters, cr), cr::CrystalOn::mask);
  chip.run(RccModel::crystal_start_time - 1);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, cr)) & cr::CrystalReady::mask, 0U);
  chip.run(1);
  EXPECT_NE(chip.get(offsetof(RccRegisters, cr)) & cr::CrystalReady::mask, 0U);
  chip.put(offsetof(RccRegisters, cr), 0x83);
  EXPECT_EQ(chip.get(offsetof(RccRegisters, cr)) & cr::CrystalReady::mask, 0U);
}

TEST(RccClocks, TheSwitchWaitsForItsSource) {
  Chip chip;
  chip.set(offsetof(RccRegisters, cr), cr::CrystalOn::mask);
  chip.put(offsetof(RccRegisters, cfgr), cfgr::Switch::bits(cfgr::crystal));
  chip.run(RccModel::crystal_start_time / 2);
  EXPECT_EQ(chip.source(), cfgr::internal);
  EXPECT_EQ(chip.clocks.core, units_per_period(16'000'000));
  chip.run(RccModel::crystal_start_time / 2);
  EXPECT_EQ(chip.source(), cfgr::crystal);
  EXPECT_EQ(chip.clocks.core, units_per_period(8'000'000));
}

TEST(RccClocks, PrescalersAndTheTimersDoubling) {
  Chip chip;
  chip.put(offsetof(RccRegisters, cfgr), cfgr::AhbPrescaler::bits(9) | cfgr::Apb1Prescaler::bits(7));
  EXPECT_EQ(chip.clocks.core, units_per_period(4'000'000));
  EXPECT_EQ(chip.clocks.apb1, units_per_period(250'000));
  EXPECT_EQ(chip.clocks.apb1_timer, units_per_period(500'000)) << "divided bus: twice its clock";
  EXPECT_EQ(chip.clocks.apb2, units_per_period(4'000'000));
  EXPECT_EQ(chip.clocks.apb2_timer, units_per_period(4'000'000)) << "undivided bus: its clock";
}

TEST(RccLimits, PllInputAndVcoAreChecked) {
  struct Row {
    const char* what;
    std::uint32_t m, n, q;
    const char* expected;
  };
  for (const Row& row :
       {Row{"input", 3, 120, 7, "PLL input 2.66 MHz"}, Row{"input", 9, 336, 7, "PLL input 0.88"},
        Row{"VCO", 8, 191, 7, "VCO at 191.00 MHz"}, Row{"VCO", 8, 433, 15, "VCO at 433.00"},
        Row{"M", 1, 24, 7, "M = 1"}, Row{"Q", 4, 168, 6, "Q = 6"}, Row{"Q", 4, 96, 1, "Q = 1"}}) {
    Chip chip;
    chip.start_crystal();
    chip.put(offsetof(RccRegisters, pllcfgr),
             pllcfgr::InputDivider::bits(row.m) | pllcfgr::Multiplier::bits(row.n) |
                 pllcfgr::UsbDivider::bits(row.q) | pllcfgr::FromCrystal::mask);
    const std::uint32_t on = chip.get(offsetof(RccRegisters, cr)) | cr::PllOn::mask;
    const std::string refusal = chip.refusal(offsetof(RccRegisters, cr), on);
    EXPECT_NE(refusal.find(row.expected), std::string::npos) << row.what << ": " << refusal;
  }
  for (const std::uint32_t n : {96U, 216U}) {  // the VCO's limits themselves
    Chip chip;
    chip.start_crystal();
    EXPECT_NO_THROW(chip.start_pll(pllcfgr::InputDivider::bits(4) | pllcfgr::Multiplier::bits(n) |
                                   pllcfgr::UsbDivider::bits(9) | pllcfgr::FromCrystal::mask));
  }
}

TEST(RccLimits, PllNeedsItsSourceAndCannotBeChangedWhileOn) {
  Chip chip;
  chip.put(offsetof(RccRegisters, pllcfgr), divider_4_from_crystal);
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, cr), 0x83 | cr::PllOn::mask), "") << "crystal off";
  chip.start_crystal();
  chip.start_pll(divider_4_from_crystal);
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, pllcfgr), divider_4_from_crystal), "");
}

TEST(RccLimits, FullSpeedNeedsWaitStatesVoltageAndBusDividers) {
  const auto refusal_with = [](bool voltage, std::uint32_t wait_states, std::uint32_t buses) {
    Chip chip;
    if (voltage) chip.power_registers.cr = stm32::pwr_cr::VoltageScale1::mask;
    chip.flash_registers.acr = wait_states;
    chip.start_crystal();
    chip.start_pll(divider_4_from_crystal);
    return chip.refusal(offsetof(RccRegisters, cfgr), buses | cfgr::Switch::bits(cfgr::pll));
  };
  EXPECT_EQ(refusal_with(true, 5, full_speed_buses), "");
  EXPECT_NE(refusal_with(true, 4, full_speed_buses).find("wait states"), std::string::npos);
  EXPECT_NE(refusal_with(false, 5, full_speed_buses).find("voltage scale"), std::string::npos);
  EXPECT_NE(refusal_with(true, 5, cfgr::Apb1Prescaler::bits(4) | cfgr::Apb2Prescaler::bits(4)).find("PCLK1"),
            std::string::npos);
  EXPECT_NE(refusal_with(true, 5, cfgr::Apb1Prescaler::bits(5)).find("PCLK2"), std::string::npos);
}

TEST(RccLimits, WhatTheCoreRunsOnCannotBeStoppedNorItsConditionsWithdrawn) {
  Chip chip;
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, cr), cr::InternalTrim::bits(16)), "") << "HSI";
  chip.run_at_168_mhz();
  const std::uint32_t control = chip.get(offsetof(RccRegisters, cr));
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, cr), control & ~cr::PllOn::mask), "");
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, cr), control & ~cr::CrystalOn::mask), "");
  EXPECT_THROW(chip.flash_registers.acr = 4, RefusedAccess);
  EXPECT_THROW(chip.power_registers.cr = 0, RefusedAccess);
  EXPECT_EQ(chip.refusal(offsetof(RccRegisters, cr), control & ~cr::InternalOn::mask), "");
  EXPECT_EQ(chip.clocks.core, units_per_period(168'000'000));
}

TEST(RccEnables, OneBitOneClock) {
  Chip chip;
  const auto offset = static_cast<std::uint32_t>(offsetof(RccRegisters, apb1enr));
  EXPECT_FALSE(chip.rcc.clock_enabled(offset, stm32::rcc_apb1enr::Usart2::mask));
  chip.put(offset, stm32::rcc_apb1enr::Usart2::mask);
  EXPECT_TRUE(chip.rcc.clock_enabled(offset, stm32::rcc_apb1enr::Usart2::mask));
  EXPECT_FALSE(chip.rcc.clock_enabled(offset, stm32::rcc_apb1enr::Uart4::mask));
  EXPECT_FALSE(
      chip.rcc.clock_enabled(offset, stm32::rcc_apb1enr::Usart2::mask | stm32::rcc_apb1enr::Uart4::mask));
  EXPECT_THROW(chip.rcc.clock_enabled(offsetof(RccRegisters, cr), 1), std::out_of_range);
  EXPECT_NE(chip.refusal(offset, 1U << 11), "") << "WWDG is not on the board";
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, ahb1enr), 1U << 21), "") << "DMA1";
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, apb2rstr), 1U << 8), "") << "the converters";
}

// Section Clock control & status register (RCC_CSR).
TEST(RccResetFlags, SurviveAResetAndAreRemovedByRmvf) {
  Chip chip;
  EXPECT_EQ(stm32::take_reset_cause(chip.rcc_registers), ResetCause::power_on);
  EXPECT_EQ(stm32::take_reset_cause(chip.rcc_registers), ResetCause::none);
  for (const ResetCause cause : {ResetCause::pin, ResetCause::software, ResetCause::independent_watchdog,
                                 ResetCause::window_watchdog, ResetCause::low_power, ResetCause::brown_out}) {
    chip.rcc.reset(chip.now);
    chip.rcc.note_reset(cause);
    EXPECT_EQ(stm32::take_reset_cause(chip.rcc_registers), cause);
  }
  EXPECT_NE(chip.refusal(offsetof(RccRegisters, csr), stm32::rcc_csr::LowSpeedOn::mask), "");
}

// Section Clock security system (CSS).
TEST(RccClockSecurity, CrystalFailureGivesNmiAndTheInternalOscillator) {
  Chip chip;
  std::optional<bool> nmi;
  unsigned breaks = 0;
  chip.rcc.on_clock_security_interrupt([&](bool level, BoardTime) { nmi = level; });
  chip.rcc.on_clock_failure([&](BoardTime) { ++breaks; });
  chip.run_at_168_mhz();
  chip.set(offsetof(RccRegisters, cr), cr::ClockSecurity::mask);
  chip.rcc.fail_crystal(chip.now);
  EXPECT_EQ(nmi, true);
  EXPECT_EQ(breaks, 1U);
  EXPECT_EQ(chip.source(), cfgr::internal);
  EXPECT_EQ(chip.clocks.core, units_per_period(16'000'000));
  EXPECT_EQ(chip.clocks.apb1, units_per_period(4'000'000)) << "the prescalers stay";
  EXPECT_EQ(chip.get(offsetof(RccRegisters, cr)) & (cr::CrystalOn::mask | cr::PllOn::mask), 0U);
  EXPECT_FALSE(chip.rcc.core_clock_lost());
  chip.put(offsetof(RccRegisters, cir), stm32::rcc_cir::ClockSecurityClear::mask);
  EXPECT_EQ(nmi, false);
}

TEST(RccClockSecurity, WithoutItTheCoreStops) {
  Chip chip;
  chip.run_at_168_mhz();
  chip.rcc.fail_crystal(chip.now);
  EXPECT_TRUE(chip.rcc.core_clock_lost());
  Chip on_internal;
  on_internal.start_crystal();
  on_internal.rcc.fail_crystal(on_internal.now);
  EXPECT_FALSE(on_internal.rcc.core_clock_lost()) << "nothing depended on it";
}

TEST(Pwr, VoltageScaleMustBeChosen) {
  BoardClocks clocks;
  PwrModel model{clocks};
  EXPECT_FALSE(model.voltage_scale_1());
  model.write({0, 4, 0}, 1U << 14);
  EXPECT_TRUE(model.voltage_scale_1());
  EXPECT_EQ(model.read({0, 4, 0}), 1U << 14);
  EXPECT_EQ(model.read({4, 4, 0}), 1U << 14) << "VOSRDY";
  model.reset(0);
  EXPECT_FALSE(model.voltage_scale_1());
}

TEST(Pwr, RefusesTheRest) {
  BoardClocks clocks;
  PwrModel model{clocks};
  for (const unsigned bit : {0U, 1U, 4U, 8U, 15U})
    EXPECT_THROW(model.write({0, 4, 0}, 1U << bit), RefusedAccess) << bit;
  EXPECT_THROW(model.write({4, 4, 0}, 0), RefusedAccess);
  EXPECT_THROW(model.read({8, 4, 0}), RefusedAccess);
}

// drivers/stm32f4/clock_tree.hpp on the models of RCC, PWR and FLASH.
struct ClockTreeChip : testing::SystemOnModel {
  stm32::ClockFrequencies start(stm32::ClockWaits waits = {}) {
    return stm32::ClockTree<testing::RccOnModel, testing::PwrOnModel, testing::FlashOnModel>{
        rcc_registers, power_registers, flash_registers, waits}
        .start();
  }
  void expect_clocks(std::uint64_t core, std::uint64_t apb1, std::uint64_t apb2, std::uint64_t apb1_timer,
                     std::uint64_t apb2_timer) const {
    EXPECT_EQ(clocks.core, units_per_period(core));
    EXPECT_EQ(clocks.apb1, units_per_period(apb1));
    EXPECT_EQ(clocks.apb2, units_per_period(apb2));
    EXPECT_EQ(clocks.apb1_timer, units_per_period(apb1_timer));
    EXPECT_EQ(clocks.apb2_timer, units_per_period(apb2_timer));
  }
};

TEST(ClockTreeOnModel, EndsAt168MHzFromTheCrystal) {
  ClockTreeChip chip;
  EXPECT_EQ(chip.start().source, stm32::ClockSource::crystal_pll);
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
  const double start_up = seconds(chip.now);
  EXPECT_EQ(static_cast<std::uint32_t>(chip.flash_registers.acr), 0x705U);
  EXPECT_GT(start_up, 2.2e-3) << "crystal and PLL take that long";
  EXPECT_LT(start_up, 2.3e-3);
}

TEST(ClockTreeOnModel, SurvivesARestartWithTheCoreOnThePll) {
  ClockTreeChip chip;
  ASSERT_EQ(chip.start().source, stm32::ClockSource::crystal_pll);
  EXPECT_EQ(chip.start().source, stm32::ClockSource::crystal_pll)
      << "as after a boot loader: no reset in between";
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
}

TEST(ClockTreeOnModel, DeadCrystalGives168MHzFromTheInternalOscillator) {
  ClockTreeChip chip;
  chip.rcc.set_crystal_works(false);
  EXPECT_EQ(chip.start().source, stm32::ClockSource::internal_pll);
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
  EXPECT_EQ(static_cast<std::uint32_t>(chip.rcc_registers.cr) & cr::CrystalOn::mask, 0U)
      << "a crystal that does not start is switched off";
}

TEST(ClockTreeOnModel, DeadPllLeaves16MHz) {
  ClockTreeChip chip;
  chip.rcc.set_pll_locks(false);
  EXPECT_EQ(chip.start().source, stm32::ClockSource::internal);
  chip.expect_clocks(16'000'000, 16'000'000, 16'000'000, 16'000'000, 16'000'000);
}

TEST(ClockTreeOnModel, AWaitTooShortForTheCrystalIsSeen) {
  ClockTreeChip chip;
  // 20 units per access: 0.6 ms, the crystal takes 2.
  EXPECT_EQ(chip.start({.crystal = 10'000, .pll = 20'000, .other = 1'000}).source,
            stm32::ClockSource::internal_pll);
}

TEST(ClockTreeOnModel, ResetBringsTheInternalOscillatorBack) {
  ClockTreeChip chip;
  ASSERT_EQ(chip.start().source, stm32::ClockSource::crystal_pll);
  chip.rcc.reset(chip.now);
  chip.power.reset(chip.now);
  chip.flash.reset(chip.now);
  chip.expect_clocks(16'000'000, 16'000'000, 16'000'000, 16'000'000, 16'000'000);
  EXPECT_EQ(chip.start().source, stm32::ClockSource::crystal_pll);
}

/// A register that is broken: what is read or written is changed on the way.
struct BrokenRegister {
  using Change = std::function<std::uint32_t(std::uint32_t)>;

  explicit operator std::uint32_t() const {
    ++reads;
    return read(static_cast<std::uint32_t>(behind));
  }
  BrokenRegister& operator=(std::uint32_t word) {
    written = word;
    behind = write(word);
    return *this;
  }

  RegisterOnModel behind;
  Change read = std::identity{}, write = std::identity{};
  std::uint32_t written = 0;
  mutable unsigned reads = 0;
};
struct BrokenRcc {
  BrokenRegister cr, pllcfgr, cfgr, apb1enr;
};
struct BrokenPwr {
  BrokenRegister cr;
};
struct BrokenFlash {
  BrokenRegister acr;
};

/// Parts of the clocks that can be broken one by one.
struct BrokenChip : ClockTreeChip {
  BrokenChip() {
    broken.cr.read = [this](std::uint32_t word) {
      const bool from_crystal =
          pllcfgr::FromCrystal::of(static_cast<std::uint32_t>(rcc_registers.pllcfgr)) != 0;
      if (!internal_starts) word &= ~cr::InternalReady::mask;
      if (!crystal_starts) word &= ~cr::CrystalReady::mask;
      if (!(from_crystal ? pll_locks_on_crystal : pll_locks_on_internal)) word &= ~cr::PllReady::mask;
      return word;
    };
    broken.cfgr.write = [this](std::uint32_t word) {
      const std::uint32_t wanted = cfgr::Switch::of(word);
      const bool switches = wanted == cfgr::pll ? switch_to_pll_works : switch_to_internal_works;
      return switches ? word : (word & ~cfgr::Switch::mask) | cfgr::Switch::bits(source());
    };
    broken_power.cr.write = [this](std::uint32_t word) {
      EXPECT_NE(static_cast<std::uint32_t>(rcc_registers.apb1enr) & stm32::rcc_apb1enr::Power::mask, 0U);
      return word;
    };
    broken_flash.acr.read = [this](std::uint32_t word) { return wait_states_stick ? word : word & ~7U; };
  }
  std::uint32_t source() { return cfgr::SwitchStatus::of(static_cast<std::uint32_t>(rcc_registers.cfgr)); }
  stm32::ClockSource start_broken(stm32::ClockWaits waits = {}) {
    return stm32::ClockTree<BrokenRcc, BrokenPwr, BrokenFlash>{broken, broken_power, broken_flash, waits}
        .start()
        .source;
  }

  bool internal_starts = true, crystal_starts = true;
  bool pll_locks_on_crystal = true, pll_locks_on_internal = true;
  bool switch_to_pll_works = true, switch_to_internal_works = true, wait_states_stick = true;
  BrokenRcc broken{
      {rcc_registers.cr}, {rcc_registers.pllcfgr}, {rcc_registers.cfgr}, {rcc_registers.apb1enr}};
  BrokenPwr broken_power{{power_registers.cr}};
  BrokenFlash broken_flash{{flash_registers.acr}};
};

TEST(ClockTreeOnBrokenChip, EachDefectLeavesItsSource) {
  struct Row {
    const char* what;
    void (*make)(BrokenChip&);
    stm32::ClockSource source;
  };
  using enum stm32::ClockSource;
  for (const Row& row :
       {Row{"a PLL that locks only on the internal oscillator",
            [](BrokenChip& chip) { chip.pll_locks_on_crystal = false; }, internal_pll},
        Row{"wait states that do not stick forbid full speed",
            [](BrokenChip& chip) { chip.wait_states_stick = false; }, internal},
        Row{"a switch that does not happen", [](BrokenChip& chip) { chip.switch_to_pll_works = false; },
            internal},
        Row{"a clock control that shows nothing ready",
            [](BrokenChip& chip) {
              chip.broken.cr.read = [](std::uint32_t word) { return word & cr::InternalTrim::mask; };
            },
            unresponsive},
        Row{"an internal oscillator that cannot be reached: the PLL under the core must not be stopped",
            [](BrokenChip& chip) {
              chip.start();
              chip.switch_to_internal_works = false;
            },
            unresponsive}}) {
    SCOPED_TRACE(row.what);
    BrokenChip chip;
    row.make(chip);
    EXPECT_EQ(chip.start_broken(), row.source);
    if (row.source != internal) continue;
    chip.expect_clocks(16'000'000, 16'000'000, 16'000'000, 16'000'000, 16'000'000);
    EXPECT_EQ(chip.broken.cfgr.written & cfgr::Switch::mask, 0U)
        << "a late switch must not happen behind the program's back";
    EXPECT_EQ(static_cast<std::uint32_t>(chip.rcc_registers.cr) & cr::PllOn::mask, 0U);
  }
}

TEST(ClockTreeOnBrokenChip, WaitBoundsAreRespectedExactly) {
  BrokenChip chip;
  chip.crystal_starts = chip.pll_locks_on_internal = false;
  EXPECT_EQ(chip.start_broken({.crystal = 500, .pll = 70, .other = 9}), stm32::ClockSource::internal);
  // 500 for the crystal, 70 for the PLL; what is ready at once and the read-modify-writes add a handful.
  EXPECT_GE(chip.broken.cr.reads, 570U);
  EXPECT_LE(chip.broken.cr.reads, 570U + 20U);
}

// The models refuse each step that the manual forbids on the way.
RC_GTEST_PROP(ClockTreeOnBrokenChip, EveryMixOfDefectsEndsWithAnHonestResult,
              (bool internal, bool crystal, bool lock_crystal, bool lock_internal, bool to_pll,
               bool to_internal, bool latency, bool boot_loader)) {
  BrokenChip chip;
  chip.access_time = 2000;  // so that oscillators start within the reads
  if (boot_loader) chip.start();
  chip.internal_starts = internal;
  chip.crystal_starts = crystal;
  chip.pll_locks_on_crystal = lock_crystal;
  chip.pll_locks_on_internal = lock_internal;
  chip.switch_to_pll_works = to_pll;
  chip.switch_to_internal_works = to_internal;
  chip.wait_states_stick = latency;
  const stm32::ClockSource source = chip.start_broken({.crystal = 400, .pll = 100, .other = 100});
  RC_ASSERT(chip.broken.cr.reads + chip.broken.cfgr.reads + chip.broken_flash.acr.reads < 1500U);
  const bool on_pll = chip.source() == cfgr::pll;
  const bool full = chip.clocks.core == units_per_period(168'000'000);
  RC_ASSERT(on_pll == full);
  using Source = stm32::ClockSource;
  if (source != Source::unresponsive)
    RC_ASSERT(full == (source == Source::crystal_pll || source == Source::internal_pll));
  const auto pll = static_cast<std::uint32_t>(chip.rcc_registers.pllcfgr);
  if (full && source != Source::unresponsive)
    RC_ASSERT((pllcfgr::FromCrystal::of(pll) != 0) == (source == Source::crystal_pll));
}

}  // namespace kmax::virtual_board::rcc_test
