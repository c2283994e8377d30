// DRV8301 data sheet: SPI communication, Register maps, EN_GATE, Fault and protection handling.
#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"

#include <gtest/gtest.h>

#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board::drv8301_chip_test {

using drivers::Drv8301Fault;
constexpr BoardTime us = units_per_microsecond;

struct Bench {
  Bench() {
    chip.on_fault_output([this](bool level, BoardTime) { fault_line = level; });
    chip.enable_gate(true, now);
    run(10'000 * us);
  }
  void run(BoardTime duration) {
    now += duration;
    if (chip.next_event() <= now) chip.advance(now);
  }
  std::optional<std::uint16_t> frame(unsigned word) {
    run(us);
    chip.select(false, now);
    const auto reply = chip.exchange(static_cast<std::uint16_t>(word), now);
    chip.select(true, now);
    return reply;
  }
  unsigned read(unsigned address) {
    frame(0x8000 | address << 11);
    return frame(0x8000 | address << 11).value_or(0xFFFF);
  }
  void pulse(BoardTime low) {
    chip.enable_gate(false, now);
    run(low);
    chip.enable_gate(true, now);
  }
  BoardTime now = 1000;
  bool fault_line = false;
  Drv8301Chip chip;
};

TEST(Drv8301Chip, ReplyComesOneFrameLaterWithItsAddress) {
  Bench bench;
  bench.frame(0x8800);
  EXPECT_EQ(bench.frame(0x9000), 0x0801) << "status 2: device number 1";
  EXPECT_EQ(bench.frame(0x9800), 0x1000);
  bench.frame(0x1000 | 0x550);
  EXPECT_EQ(bench.read(2), 0x1550U);
}

TEST(Drv8301Chip, IsSilentWhileStartingDisabledOrNotSelected) {
  Bench bench;
  EXPECT_TRUE(bench.frame(0x8800).has_value());
  EXPECT_EQ(bench.chip.exchange(0x8800, bench.now), std::nullopt);
  bench.chip.enable_gate(false, bench.now);
  EXPECT_EQ(bench.frame(0x8800), std::nullopt);
  bench.run(100 * us);
  bench.chip.enable_gate(true, bench.now);
  EXPECT_EQ(bench.frame(0x8800), std::nullopt);
  EXPECT_FALSE(bench.fault_line) << "nFAULT is low while the chip starts";
  bench.run(10'000 * us);
  EXPECT_TRUE(bench.fault_line);
  EXPECT_TRUE(bench.frame(0x8800).has_value());
}

TEST(Drv8301Chip, DoesNotStartWhileItsPhasePinsAreHighAndTriesAtTheNextRise) {
  Bench bench;
  bench.chip.enable_gate(false, bench.now);
  bench.run(100 * us);
  bench.chip.enable_gate(true, bench.now, false);
  bench.run(1'000'000 * us);
  EXPECT_EQ(bench.frame(0x8800), std::nullopt);
  EXPECT_FALSE(bench.fault_line);
  EXPECT_FALSE(bench.chip.drives_gates(bench.now));
  bench.pulse(100 * us);
  bench.run(10'000 * us);
  EXPECT_TRUE(bench.frame(0x8800).has_value());
  EXPECT_TRUE(bench.fault_line);
}

TEST(Drv8301Chip, FullResetForgetsSettingsQuickResetOnlyFaults) {
  Bench bench;
  bench.frame(0x1000 | 0x550);
  bench.chip.over_current(Drv8301Fault::over_current_a_high, bench.now);
  EXPECT_FALSE(bench.fault_line);
  EXPECT_FALSE(bench.chip.drives_gates(bench.now));
  bench.pulse(5 * us);
  EXPECT_TRUE(bench.fault_line);
  EXPECT_EQ(bench.read(2), 0x1550U);
  bench.pulse(20 * us);
  bench.run(10'000 * us);
  EXPECT_EQ(bench.read(2), 0x1000U);
}

TEST(Drv8301Chip, OverCurrentDoesWhatItsModeSays) {
  for (unsigned mode = 0; mode < 4; ++mode) {
    Bench bench;
    bench.frame(0x1000 | mode << 4);
    bench.chip.over_current(Drv8301Fault::over_current_b_low, bench.now);
    EXPECT_EQ(bench.fault_line, mode != 1) << mode;
    EXPECT_EQ(bench.read(0), (mode == 3 ? 0U : 0x004U) | (mode == 1 ? 0x400U : 0U)) << mode;
    EXPECT_EQ(bench.read(0), mode == 1 ? 0x400U : 0U) << "reading clears all but FAULT";
  }
}

TEST(Drv8301Chip, LastingConditionComesBack) {
  Bench bench;
  bench.chip.set_condition(Drv8301Fault::gate_supply_under_voltage, true, bench.now);
  EXPECT_EQ(bench.read(0), 0x600U);
  EXPECT_EQ(bench.read(0), 0x600U);
  bench.pulse(5 * us);
  EXPECT_FALSE(bench.fault_line);
  bench.chip.set_condition(Drv8301Fault::gate_supply_under_voltage, false, bench.now);
  EXPECT_FALSE(bench.fault_line) << "latched until a reset";
  bench.pulse(5 * us);
  EXPECT_TRUE(bench.fault_line);
}

TEST(Drv8301Chip, GateSupplyOverVoltageNeedsAFullReset) {
  Bench bench;
  bench.chip.set_condition(Drv8301Fault::gate_supply_over_voltage, true, bench.now);
  bench.chip.set_condition(Drv8301Fault::gate_supply_over_voltage, false, bench.now);
  bench.pulse(5 * us);
  EXPECT_EQ(bench.read(1), 0x0881U);
  EXPECT_FALSE(bench.fault_line);
  bench.pulse(25 * us);
  bench.run(10'000 * us);
  EXPECT_EQ(bench.read(1), 0x0801U);
  EXPECT_TRUE(bench.fault_line);
}

TEST(Drv8301Chip, OverTemperatureWarningDoesNotPullTheLine) {
  Bench bench;
  bench.chip.set_condition(Drv8301Fault::over_temperature_warning, true, bench.now);
  EXPECT_TRUE(bench.fault_line);
  EXPECT_EQ(bench.read(0), 0x040U);
}

TEST(Drv8301Chip, PowerCycleLosesSettingsAndShowsOnTheLine) {
  Bench bench;
  bench.frame(0x1000 | 0x550);
  bench.chip.power_cycle(bench.now);
  EXPECT_FALSE(bench.fault_line);
  bench.run(10'000 * us);
  EXPECT_TRUE(bench.fault_line);
  EXPECT_EQ(bench.read(2), 0x1000U);
}

TEST(Drv8301Chip, RefusesWhatTheDataSheetDoesNotAllow) {
  Bench bench;
  EXPECT_THROW(bench.frame(0x2000), RefusedAccess) << "register 4";
  EXPECT_THROW(bench.frame(0x0001), RefusedAccess) << "status is read-only";
  EXPECT_THROW(bench.frame(0x1880), RefusedAccess) << "reserved bits of control 2";
  bench.chip.select(true, bench.now);
  bench.chip.select(false, bench.now);
  bench.chip.exchange(0x8800, bench.now);
  EXPECT_THROW(bench.chip.exchange(0x8800, bench.now), RefusedAccess) << "nSCS has to rise after 16 bits";
}

}  // namespace kmax::virtual_board::drv8301_chip_test
