#include "firmware/drive/axis_state_machine.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

#include "tests/firmware/drive/drive_model.hpp"

namespace kmax::firmware::axis_state_machine_test {
namespace {

using enum DriveState;
constexpr std::array all_states = {
    not_ready_to_switch_on, switch_on_disabled, ready_to_switch_on,    switched_on,
    operation_enabled,      quick_stop_active,  fault_reaction_active, fault};

// A machine in `state` that saw `previous` last; nothing if no sequence leads there.
std::optional<AxisStateMachine> machine_in(DriveState state, std::uint16_t previous) {
  AxisStateMachine m;
  const auto say = [&m](std::uint16_t word, Refusal obstacle = Refusal::none) {
    m.command(word, Link::serial, obstacle, true);
  };
  if (state != not_ready_to_switch_on) m.initialised();
  switch (state) {
    case not_ready_to_switch_on:
    case switch_on_disabled:
      break;
    case ready_to_switch_on:
      say(0x06);
      break;
    case switched_on:
      say(0x06), say(0x07);
      break;
    case operation_enabled:
      say(0x06), say(0x07), say(0x0F);
      break;
    case quick_stop_active:
      say(0x06), say(0x0F), say(0x02);
      break;
    case fault_reaction_active:
    case fault:
      say(0x06), say(0x0F);
      m.trip(Fault::over_speed);
      if (state == fault) m.reaction_done();
      break;
  }
  if (state != operation_enabled || previous != 0x0F) say(previous, Refusal::handle_inside_wall);
  if (m.state() != state) return std::nullopt;
  return m;
}

// By a word that leads there.
AxisStateMachine machine_in(DriveState state) {
  return *machine_in(state, state == operation_enabled ? 0x0F : state == switched_on ? 0x07 : 0x86);
}

// Words that set bits 3 and 7 of the previous word in each way, with the other bits in several ways.
constexpr std::uint16_t previous_words[] = {0x00, 0x02, 0x06, 0x07, 0x08, 0x0A, 0x0E, 0x0F,   0x80,
                                            0x82, 0x86, 0x87, 0x88, 0x8A, 0x8E, 0x8F, 0xFF70, 0xFFFF};

TEST(AxisStateMachine, EveryStateWithEveryControlwordFollowsTheStandardsTables) {
  std::set<std::pair<DriveState, DriveState>> moves;
  for (const DriveState state : all_states) {
    std::set<unsigned> edges;  // bits 3 and 7 of the words before
    for (const std::uint16_t previous : previous_words) {
      const auto start = machine_in(state, previous);
      if (!start) continue;
      edges.insert(previous & 0x88u);
      for (unsigned word = 0; word <= 0xFFFF; ++word) {
        for (unsigned conditions = 0; conditions < 8; ++conditions) {
          const Refusal obstacle = (conditions & 1) != 0 ? Refusal::encoder_invalid : Refusal::none;
          const bool cause_remains = (conditions & 2) != 0, stays = (conditions & 4) != 0;
          AxisStateMachine machine = *start;
          DriveModel model{state, previous, machine.refusal()};
          const bool asks = machine.asks_to_enable(static_cast<std::uint16_t>(word), Link::serial);
          machine.command(static_cast<std::uint16_t>(word), Link::serial, obstacle, cause_remains,
                          {.stay_in_quick_stop = stays});
          model.command(word, obstacle, cause_remains, stays);
          const bool became_enabled = state != operation_enabled && model.state == operation_enabled;
          const Fault fault = model.state == DriveState::fault || model.state == fault_reaction_active
                                  ? Fault::over_speed
                                  : Fault::none;
          if (machine.state() != model.state || machine.refusal() != model.refusal ||
              machine.fault() != fault || machine.armed() != (model.state == operation_enabled) ||
              (obstacle == Refusal::none && asks != became_enabled)) {
            FAIL() << "from state " << int(state) << ", previous word " << previous << ", word " << word
                   << ", conditions " << conditions << ": " << int(machine.state()) << ", not "
                   << int(model.state);
          }
          if (model.state != state) moves.insert({state, model.state});
        }
      }
    }
    // Each of bits 3 and 7 must have been seen both ways. A word with neither leaves "operation enabled".
    std::set<unsigned> all = {0x00, 0x08, 0x80, 0x88};
    if (state == operation_enabled) all.erase(0x00);
    EXPECT_EQ(edges, all) << int(state);
  }
  // Every way from one state to another that a command may take, and no other. Two in one go: 3 and 4, and
  // 11 and 12 with the option.
  std::set<std::pair<DriveState, DriveState>> allowed = {{fault, switch_on_disabled},
                                                         {ready_to_switch_on, operation_enabled},
                                                         {operation_enabled, switch_on_disabled}};
  for (const auto& t : DriveModel::transitions) allowed.insert({t.from, t.to});
  EXPECT_EQ(moves, allowed);
}

// 6 in object 0x605A, and what a machine does that is told nothing.
TEST(AxisStateMachine, QuickStopStaysUnlessTheOptionSaysOtherwiseAndALaterOptionMovesNothing) {
  auto m = *machine_in(operation_enabled, 0x0F);
  auto other = m;
  m.command(0x02, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), quick_stop_active);
  EXPECT_FALSE(m.armed());
  for (const unsigned word : {0x02u, 0x06u, 0x07u, 0x0Fu, 0x82u}) {
    m.command(static_cast<std::uint16_t>(word), Link::serial, Refusal::none, false,
              {.stay_in_quick_stop = false});
    EXPECT_EQ(m.state(), quick_stop_active) << word;
  }
  m.command(0x00, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), switch_on_disabled);

  other.command(0x02, Link::serial, Refusal::none, false, {.stay_in_quick_stop = false});
  EXPECT_EQ(other.state(), switch_on_disabled);
  EXPECT_FALSE(other.armed());
  other.command(0x0F, Link::serial, Refusal::none, false);
  EXPECT_EQ(other.state(), switch_on_disabled);
}

// Halt is mode torque's business: the automaton sees no difference.
TEST(Controlword, HaltIsBit8AndNothingElse) {
  for (unsigned word = 0; word <= 0xFFFF; ++word)
    ASSERT_EQ(halted(static_cast<std::uint16_t>(word)), (word >> 8) % 2 == 1) << word;
}

TEST(AxisStateMachine, EnablingStraightFromSwitchOnDisabledDoesNothing) {
  AxisStateMachine m;
  m.initialised();
  for (int i = 0; i < 3; ++i) {
    m.command(0x0F, Link::serial, Refusal::none, false);
    EXPECT_EQ(m.state(), switch_on_disabled);
    EXPECT_EQ(m.refusal(), Refusal::none);
  }
  // Neither does it count as the edge of a later one: after shutdown a fresh edge is there again.
  m.command(0x06, Link::serial, Refusal::none, false);
  m.command(0x0F, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), operation_enabled);
}

TEST(AxisStateMachine, HeldWordAfterARefusalNeverArms) {
  for (const DriveState from : {ready_to_switch_on, switched_on}) {
    auto m = *machine_in(from, from == switched_on ? 0x07 : 0x06);
    m.command(0x0F, Link::serial, Refusal::handle_inside_wall, false);
    EXPECT_EQ(m.state(), switched_on);
    EXPECT_EQ(m.refusal(), Refusal::handle_inside_wall);
    // With the bits that do not matter changing, and through words that are no command.
    for (const unsigned word : {0x0Fu, 0x1Fu, 0xFF7Fu, 0x0Fu, 0x8Fu, 0x0Fu}) {
      m.command(static_cast<std::uint16_t>(word), Link::serial, Refusal::none, false);
      EXPECT_EQ(m.state(), switched_on) << word;
      EXPECT_EQ(m.refusal(), Refusal::handle_inside_wall);
    }
    m.command(0x07, Link::serial, Refusal::none, false);
    m.command(0x0F, Link::serial, Refusal::none, false);
    EXPECT_EQ(m.state(), operation_enabled);
    EXPECT_EQ(m.refusal(), Refusal::none);
  }
}

TEST(AxisStateMachine, FaultResetIsAnEdgeAndAHeldBitNeverResetsAgain) {
  auto m = *machine_in(operation_enabled, 0x0F);
  m.command(0x8F, Link::serial, Refusal::none, false);  // bit 7 was already up when the fault came
  m.trip(Fault::encoder);
  m.reaction_done();
  for (int i = 0; i < 3; ++i) {
    m.command(0x80, Link::serial, Refusal::none, false);
    EXPECT_EQ(m.state(), fault);
  }
  m.command(0x00, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), fault);
  m.command(0x80, Link::serial, Refusal::none, true);
  EXPECT_EQ(m.state(), fault) << "the cause remains";
  EXPECT_EQ(m.refusal(), Refusal::fault_present);
  EXPECT_EQ(m.fault(), Fault::encoder);
  m.command(0x80, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), fault) << "held, no edge";
  m.command(0x00, Link::serial, Refusal::none, false);
  m.command(0x80, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), switch_on_disabled);
  EXPECT_EQ(m.fault(), Fault::none);
  EXPECT_EQ(m.refusal(), Refusal::none);
}

TEST(AxisStateMachine, ResetEdgeDuringTheReactionIsNotKeptForLater) {
  auto m = *machine_in(fault_reaction_active, 0x00);
  m.command(0x80, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), fault_reaction_active);
  m.reaction_done();
  m.command(0x80, Link::serial, Refusal::none, false);
  EXPECT_EQ(m.state(), fault);
}

TEST(AxisStateMachine, TripsFromEveryStateAndTheFirstFaultIsKept) {
  for (const DriveState state : all_states) {
    auto m = machine_in(state);
    m.trip(Fault::none);
    EXPECT_EQ(m.state(), state);
    const Fault before = m.fault();
    m.trip(Fault::link_silent);
    const bool was_faulty = state == fault || state == fault_reaction_active;
    EXPECT_EQ(m.state(), was_faulty ? state : fault_reaction_active);
    EXPECT_EQ(m.fault(), was_faulty ? before : Fault::link_silent);
    EXPECT_FALSE(m.armed());
    m.trip(Fault::encoder);
    EXPECT_EQ(m.fault(), was_faulty ? before : Fault::link_silent);
    m.reaction_done();
    EXPECT_EQ(m.state(), fault);
  }
}

TEST(AxisStateMachine, EndOfInitialisationAndOfReactionActOnlyInTheirState) {
  for (const DriveState state : all_states) {
    auto m = machine_in(state);
    auto other = m;
    m.initialised();
    EXPECT_EQ(m.state(), state == not_ready_to_switch_on ? switch_on_disabled : state);
    other.reaction_done();
    EXPECT_EQ(other.state(), state == fault_reaction_active ? fault : state);
  }
}

TEST(Controlword, BitsOfBothWordsAreTheStandards) {
  using Bits = std::array<unsigned, 6>;
  EXPECT_EQ((Bits{controlword::switch_on, controlword::enable_voltage, controlword::quick_stop,
                  controlword::enable_operation, controlword::fault_reset, controlword::halt}),
            (Bits{0x0001, 0x0002, 0x0004, 0x0008, 0x0080, 0x0100}));
  EXPECT_EQ(
      (Bits{statusword::voltage_enabled, statusword::warning, statusword::remote, statusword::target_reached,
            statusword::internal_limit_active, statusword::follows_command_value}),
      (Bits{0x0010, 0x0080, 0x0200, 0x0400, 0x0800, 0x1000}));
}

TEST(Controlword, WhatAsksForOperationAndWhatHalts) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    ASSERT_EQ(asks_for_operation(static_cast<std::uint16_t>(word)), (word & 0x8F) == 0x0F) << word;
    ASSERT_EQ(halted(static_cast<std::uint16_t>(word)), (word & 0x100) != 0) << word;
  }
}

TEST(Statusword, MasksOfTheStandardTellEveryStateWhateverTheOtherBits) {
  struct Pattern {
    DriveState state;
    unsigned mask, value;
  };
  constexpr Pattern patterns[] = {{not_ready_to_switch_on, 0x4F, 0x00}, {switch_on_disabled, 0x4F, 0x40},
                                  {ready_to_switch_on, 0x6F, 0x21},     {switched_on, 0x6F, 0x23},
                                  {operation_enabled, 0x6F, 0x27},      {quick_stop_active, 0x6F, 0x07},
                                  {fault_reaction_active, 0x4F, 0x0F},  {fault, 0x4F, 0x08}};
  for (const Pattern& row : patterns) {
    EXPECT_EQ(statusword::base_of(row.state) & row.mask, row.value);
    for (unsigned word = 0; word <= 0xFFFF; ++word) {
      if ((word & row.mask) != row.value) continue;
      ASSERT_EQ(statusword::state_of(static_cast<std::uint16_t>(word)), row.state) << word;
    }
    for (unsigned extra = 0; extra <= 0xFFFF; extra += 16) {
      const auto shown = static_cast<std::uint16_t>(statusword::base_of(row.state) | (extra & ~0x6Fu));
      ASSERT_EQ(statusword::state_of(shown), row.state) << shown;
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_state_machine_test
