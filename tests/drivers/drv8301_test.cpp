#include "drivers/drv8301.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <string>

namespace kmax::drivers::drv8301_test {

/// A minimal chip by the frame rules alone, and a line that can be tampered with.
struct FakeChip {
  void select(bool active) {
    EXPECT_NE(active, selected);
    selected = active;
    order += active ? '[' : ']';
  }
  void delay_us(std::uint32_t us) { waited += us; }
  std::optional<std::uint16_t> exchange(std::uint16_t word) {
    EXPECT_TRUE(selected);
    order += 'x';
    ++frames;
    if (dead) return std::nullopt;
    const std::uint16_t out = tamper(reply);
    const unsigned address = word >> 11 & 0xFU;
    EXPECT_LT(address, 4U);
    if ((word & 0x8000) == 0) {
      writes.push_back(word);
      if (lost_writes != 0) {
        --lost_writes;
      } else {
        registers[address] = word & 0x7FF;
      }
    }
    reply = static_cast<std::uint16_t>(address << 11 | registers[address]);
    if (address == 0 && (word & 0x8000) != 0) registers[0] = 0;
    return out;
  }
  std::uint16_t tamper(std::uint16_t word) {
    if (replies.empty()) return word;
    const auto [mask, value] = replies.front();
    replies.pop_front();
    return static_cast<std::uint16_t>((word & mask) | value);
  }
  void disturb_all(std::uint16_t mask, std::uint16_t value) { replies.assign(1000, {mask, value}); }

  std::uint16_t registers[4] = {0, 1, 0, 0};
  std::uint16_t reply = 0;
  bool selected = false, dead = false;
  unsigned frames = 0, lost_writes = 0;
  std::uint32_t waited = 0;
  std::string order;
  std::vector<std::uint16_t> writes;
  std::deque<std::pair<std::uint16_t, std::uint16_t>> replies;  // (reply & first) | second
};

struct Bench {
  FakeChip chip;
  Drv8301<FakeChip> driver{chip};
};

TEST(Drv8301, ConfiguresAndEveryFrameHasItsOwnSelect) {
  Bench bench;
  EXPECT_EQ(bench.driver.configure({}), Drv8301Result::ok);
  EXPECT_EQ(bench.chip.registers[2], 0x550);
  EXPECT_EQ(bench.chip.registers[3], 0x008);
  EXPECT_EQ(bench.chip.frames, 10U);
  for (std::size_t i = 0; i < bench.chip.order.size(); i += 3)
    EXPECT_EQ(bench.chip.order.substr(i, 3), "[x]");
  EXPECT_EQ(bench.chip.waited, 20U);
}

TEST(Drv8301, LostWritesAreRepeatedFiveTimesAndThenNamed) {
  for (unsigned lost = 0; lost < 5; ++lost) {
    Bench bench;
    bench.chip.lost_writes = lost;
    EXPECT_EQ(bench.driver.configure({}), Drv8301Result::ok) << lost;
    EXPECT_EQ(bench.chip.registers[2], 0x550);
    EXPECT_EQ(bench.chip.writes.size(), 2 + lost);
  }
  Bench first;
  first.chip.lost_writes = 5;
  EXPECT_EQ(first.driver.configure({}), Drv8301Result::control_1_not_kept);
  EXPECT_EQ(first.chip.writes.size(), 5U);
}

TEST(Drv8301, EverySingleTornReplyIsSurvived) {
  // Whatever one reply is turned into, the chip is configured in the end.
  for (unsigned torn = 0; torn < 10; ++torn) {
    for (unsigned bit = 0; bit < 16; ++bit) {
      Bench bench;
      for (unsigned i = 0; i < torn; ++i) bench.chip.replies.emplace_back(0xFFFF, 0);
      bench.chip.replies.emplace_back(static_cast<std::uint16_t>(~(1U << bit)), 0);
      EXPECT_EQ(bench.driver.configure({}), Drv8301Result::ok) << torn << " bit " << bit;
      EXPECT_EQ(bench.chip.registers[2], 0x550) << torn << " bit " << bit;
      EXPECT_EQ(bench.chip.registers[3], 0x008) << torn << " bit " << bit;
    }
  }
}

TEST(Drv8301, StuckLinesAndStrangersAreNamed) {
  Bench high;
  high.chip.disturb_all(0xFFFF, 0xFFFF);
  EXPECT_EQ(high.driver.configure({}), Drv8301Result::stuck_high);
  EXPECT_TRUE(high.chip.writes.empty()) << "nothing is written to what is not there";

  Bench low;
  low.chip.disturb_all(0, 0);
  EXPECT_EQ(low.driver.configure({}), Drv8301Result::stuck_low);

  Bench shifted;
  shifted.chip.disturb_all(0x7FFF & ~0x0800, 0);
  EXPECT_EQ(shifted.driver.probe(), Drv8301Result::wrong_address);

  Bench stranger;
  stranger.chip.registers[1] = 2;
  EXPECT_EQ(stranger.driver.configure({}), Drv8301Result::wrong_device);

  Bench dead;
  dead.chip.dead = true;
  EXPECT_EQ(dead.driver.configure({}), Drv8301Result::bus_time_out);
  EXPECT_FALSE(dead.chip.selected);
}

TEST(Drv8301, RefusesACodeThatWouldReachIntoOtherFields) {
  Bench bench;
  EXPECT_EQ(bench.driver.configure({.over_current_code = 32}), Drv8301Result::bad_configuration);
  EXPECT_EQ(bench.chip.frames, 0U);
}

TEST(Drv8301, OverCurrentLevelIsNeverAboveWhatIsAskedFor) {
  for (std::uint32_t millivolts = 0; millivolts < 2600; ++millivolts) {
    const auto code = drv8301::over_current_code(millivolts);
    ASSERT_EQ(code.has_value(), millivolts >= 60);
    if (!code) continue;
    ASSERT_LE(drv8301::over_current_millivolts[*code], millivolts);
    if (*code < 31) {
      ASSERT_GT(drv8301::over_current_millivolts[*code + 1], millivolts);
    }
  }
}

// A wrong digit in the table shows in its sum; the data sheet's column adds up to this.
TEST(Drv8301, OverCurrentLevelsAreThoseOfTheDataSheet) {
  unsigned sum = 0;
  for (const unsigned level : drv8301::over_current_millivolts) sum += level;
  EXPECT_EQ(sum, 20'918U);
}

TEST(Drv8301, ControlWords) {
  // Data sheet, control register 1: OC_ADJ_SET 10:6, OCP_MODE 5:4, PWM_MODE 3, GATE_CURRENT 1:0.
  static_assert(drv8301_control_1({.over_current_code = 31,
                                   .over_current = Drv8301OverCurrent::off,
                                   .gate_current = Drv8301GateCurrent::a0_25,
                                   .three_inputs = true}) == 0x7FA);
  static_assert(drv8301_control_2({.gain = CurrentSenseGain::x80}) == 0x00C);
  static_assert(drv8301_control_2({.gain = CurrentSenseGain::x10}) == 0);
}

// Data sheet, tables of the status and control registers.
TEST(Drv8301, EachBitIsItsOwn) {
  using enum Drv8301Fault;
  unsigned bit = 0;
  for (const Drv8301Fault fault :
       {over_current_c_low, over_current_c_high, over_current_b_low, over_current_b_high, over_current_a_low,
        over_current_a_high, over_temperature_warning, over_temperature, supply_under_voltage,
        gate_supply_under_voltage, Drv8301Fault::fault, gate_supply_over_voltage, no_answer})
    EXPECT_EQ(static_cast<unsigned>(fault), 1U << bit++);
  EXPECT_EQ(drv8301::status_2_device_mask, 0x00F);
  EXPECT_EQ(drv8301::status_2_gate_supply_over_voltage, 0x080);
  EXPECT_EQ(drv8301::gate_reset, 0x004);
  EXPECT_EQ(drv8301::three_inputs, 0x008);
  EXPECT_EQ(drv8301::calibrate_channel_1, 0x010);
  EXPECT_EQ(drv8301::calibrate_channel_2, 0x020);
  EXPECT_EQ(drv8301::control_2_mask, 0x07F);
  EXPECT_EQ(drv8301::read_word(Drv8301Register::control_2), 0x9800);
  EXPECT_EQ(drv8301::write_word(Drv8301Register::control_1, 0xFFFF), 0x17FF);
  EXPECT_EQ(drv8301::address_of(0x9FFF), 3U);
  EXPECT_EQ(drv8301::address_of(0x7FFF), 15U);
}

// The faults as the chip keeps them, those of its second register above; at the next look what is over is
// gone.
TEST(Drv8301, TellsItsFaultsOnceAndGateSupplyOverVoltageAboveThem) {
  Bench bench;
  EXPECT_EQ(bench.driver.faults(), 0);
  bench.chip.registers[0] = 0x404;  // FAULT and FETLB_OC
  EXPECT_EQ(bench.driver.faults(), static_cast<unsigned>(Drv8301Fault::over_current_b_low) |
                                       static_cast<unsigned>(Drv8301Fault::fault));
  EXPECT_EQ(bench.driver.faults(), 0);
  bench.chip.registers[1] = 0x081;  // GVDD_OV
  EXPECT_EQ(bench.driver.faults(), static_cast<unsigned>(Drv8301Fault::gate_supply_over_voltage));
}

TEST(Drv8301, AChipThatIsNoneHasNoFaultsToTell) {
  Bench high, low, other, dead;
  high.chip.disturb_all(0xFFFF, 0xFFFF);
  low.chip.disturb_all(0, 0);
  other.chip.registers[1] = 2;
  dead.chip.dead = true;
  for (Bench* bench : {&high, &low, &other, &dead}) EXPECT_FALSE(bench->driver.faults());
}

TEST(Drv8301Config, ThreeInputsAreAskedFor) {
  const Drv8301Config defaults{};
  EXPECT_FALSE(defaults.three_inputs);
}

}  // namespace kmax::drivers::drv8301_test
