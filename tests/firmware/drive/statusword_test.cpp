#include "firmware/drive/statusword.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kmax::firmware::statusword_test {
namespace {

using enum DriveState;

// From CiA 402-2's table of the statusword's bits and the states' patterns, apart from the code under test.
unsigned expected(const DriveStatus& s) {
  unsigned word = 0x0200;  // bit 9: remote
  switch (s.state) {
    case not_ready_to_switch_on:
      break;
    case switch_on_disabled:
      word |= 0x0040;
      break;
    case ready_to_switch_on:
      word |= 0x0021;
      break;
    case switched_on:
      word |= 0x0023;
      break;
    case operation_enabled:
      word |= 0x0027;
      break;
    case quick_stop_active:
      word |= 0x0007;
      break;
    case fault_reaction_active:
      word |= 0x000F;
      break;
    case fault:
      word |= 0x0008;
      break;
  }
  word |= s.supplied && s.power_stage_on ? 0x0010u : 0u;
  word |= s.warning ? 0x0080u : 0u;
  word |= s.limited ? 0x0800u : 0u;
  if (s.state == quick_stop_active) word |= 0x0400;
  if (s.state == operation_enabled) {
    if (s.mode == DriveMode::torque && s.halted && s.force_is_zero) word |= 0x0400;
    if (s.mode == DriveMode::excitation && s.excitation_finished) word |= 0x0400;
    if (s.mode == DriveMode::torque && !s.halted) word |= 0x1000;
  }
  return word;
}

TEST(Statusword, EveryBitInEveryStateAndModeUnderAllConditions) {
  std::array<unsigned, 2> ever{0xFFFF, 0x0000};  // all of the words, any of them
  for (unsigned state = 0; state <= static_cast<unsigned>(fault); ++state) {
    for (const DriveMode mode : {DriveMode::haptic, DriveMode::excitation, DriveMode::torque}) {
      for (unsigned bits = 0; bits < 128; ++bits) {
        const DriveStatus status{.state = static_cast<DriveState>(state),
                                 .mode = mode,
                                 .supplied = (bits & 1) != 0,
                                 .power_stage_on = (bits & 2) != 0,
                                 .warning = (bits & 4) != 0,
                                 .limited = (bits & 8) != 0,
                                 .halted = (bits & 16) != 0,
                                 .force_is_zero = (bits & 32) != 0,
                                 .excitation_finished = (bits & 64) != 0};
        const std::uint16_t word = statusword_of(status);
        ASSERT_EQ(word, expected(status)) << state << " " << static_cast<int>(mode) << " " << bits;
        ASSERT_EQ(statusword::state_of(word), status.state) << "no bit may hide the state";
        ever = {ever[0] & word, ever[1] | word};
      }
    }
  }
  EXPECT_EQ(ever[0], 0x0200u) << "always obeys";
  EXPECT_EQ(ever[1], 0x1EFFu) << "bits 8 and 13 to 15 are never set";
}

TEST(Statusword, OfADriveThatDoesNothingIsTheStatesPattern) {
  EXPECT_EQ(statusword_of({}), 0x0200);
  EXPECT_EQ(statusword_of({.state = switch_on_disabled, .supplied = true}), 0x0240);
  EXPECT_EQ(statusword_of({.state = fault}), 0x0208);
  EXPECT_EQ(statusword_of({.power_stage_on = true}), 0x0200);
  EXPECT_EQ(statusword_of({.state = operation_enabled}), 0x0227);
  EXPECT_EQ(statusword_of({.state = operation_enabled, .mode = DriveMode::excitation}), 0x0227);
  EXPECT_EQ(statusword_of({.state = operation_enabled, .mode = DriveMode::torque}), 0x1227);
  EXPECT_EQ(statusword_of({.state = operation_enabled, .mode = DriveMode::torque, .halted = true}), 0x0227);
}

}  // namespace
}  // namespace kmax::firmware::statusword_test
