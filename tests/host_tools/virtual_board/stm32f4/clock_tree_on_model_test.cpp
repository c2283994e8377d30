// drivers/stm32f4/clock_tree.hpp on the models of RCC, PWR and FLASH.
#include <gtest/gtest.h>

#include "drivers/stm32f4/clock_tree.hpp"
#include "tests/host_tools/virtual_board/cortex_m/system_on_model.hpp"

namespace kmax::virtual_board::clock_tree_on_model_test {
namespace {

using drivers::stm32f4::ClockFrequencies;
using drivers::stm32f4::ClockSource;
using drivers::stm32f4::ClockWaits;
using testing::FlashOnModel;
using testing::PwrOnModel;
using testing::RccOnModel;

struct Chip : testing::SystemOnModel {
  ClockFrequencies start(ClockWaits waits = {}) {
    return drivers::stm32f4::ClockTree<RccOnModel, PwrOnModel, FlashOnModel>{rcc_registers, power_registers,
                                                                             flash_registers, waits}
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
  Chip chip;
  EXPECT_EQ(chip.start().source, ClockSource::crystal_pll);
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
  const double start_up = seconds(chip.bus.now);
  EXPECT_GT(start_up, 2.2e-3) << "crystal and PLL take that long";
  EXPECT_LT(start_up, 2.3e-3);
}

TEST(ClockTreeOnModel, SurvivesARestartWithTheCoreOnThePll) {
  Chip chip;
  ASSERT_EQ(chip.start().source, ClockSource::crystal_pll);
  EXPECT_EQ(chip.start().source, ClockSource::crystal_pll) << "as after a boot loader: no reset in between";
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
}

TEST(ClockTreeOnModel, DeadCrystalGives168MHzFromTheInternalOscillator) {
  Chip chip;
  chip.rcc.set_crystal_works(false);
  EXPECT_EQ(chip.start().source, ClockSource::internal_pll);
  chip.expect_clocks(168'000'000, 42'000'000, 84'000'000, 84'000'000, 168'000'000);
}

TEST(ClockTreeOnModel, DeadPllLeaves16MHz) {
  Chip chip;
  chip.rcc.set_pll_locks(false);
  EXPECT_EQ(chip.start().source, ClockSource::internal);
  chip.expect_clocks(16'000'000, 16'000'000, 16'000'000, 16'000'000, 16'000'000);
}

TEST(ClockTreeOnModel, AWaitTooShortForTheCrystalIsSeen) {
  Chip chip;
  // 20 units per access: 0.6 ms, the crystal takes 2.
  EXPECT_EQ(chip.start({.crystal = 10'000, .pll = 20'000, .other = 1'000}).source, ClockSource::internal_pll);
}

TEST(ClockTreeOnModel, ResetBringsTheInternalOscillatorBack) {
  Chip chip;
  ASSERT_EQ(chip.start().source, ClockSource::crystal_pll);
  chip.rcc.reset(chip.bus.now);
  chip.power.reset(chip.bus.now);
  chip.flash.reset(chip.bus.now);
  chip.expect_clocks(16'000'000, 16'000'000, 16'000'000, 16'000'000, 16'000'000);
  EXPECT_EQ(chip.start().source, ClockSource::crystal_pll);
}

}  // namespace
}  // namespace kmax::virtual_board::clock_tree_on_model_test
