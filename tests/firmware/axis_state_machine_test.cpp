#include "firmware/axis_state_machine.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace kmax::firmware {
namespace {

using enum DriveState;
constexpr std::array all_states = {
    not_ready_to_switch_on, switch_on_disabled, ready_to_switch_on,    switched_on,
    operation_enabled,      quick_stop_active,  fault_reaction_active, fault};

// The standard's command table (CiA 402-2, "command coding"), as masks: a bit that is not in the mask does
// not matter. Written from the standard, apart from the code under test.
enum class Row { shutdown, switch_on, disable_voltage, quick_stop, enable_operation };
struct CommandRow {
  Row row;
  unsigned mask, value;
};
constexpr CommandRow command_rows[] = {
    {Row::shutdown, 0x87, 0x06},          // 0xxx x110
    {Row::switch_on, 0x8F, 0x07},         // 0xxx 0111, also "disable operation"
    {Row::disable_voltage, 0x82, 0x00},   // 0xxx xx0x
    {Row::quick_stop, 0x86, 0x02},        // 0xxx x01x
    {Row::enable_operation, 0x8F, 0x0F},  // 0xxx 1111
};

// The standard's transitions that a command makes, by their numbers.
struct Transition {
  int number;
  DriveState from;
  Row command;
  DriveState to;
};
constexpr Transition transitions[] = {
    {2, switch_on_disabled, Row::shutdown, ready_to_switch_on},
    {3, ready_to_switch_on, Row::switch_on, switched_on},
    {4, switched_on, Row::enable_operation, operation_enabled},
    {5, operation_enabled, Row::switch_on, switched_on},
    {6, switched_on, Row::shutdown, ready_to_switch_on},
    {7, ready_to_switch_on, Row::disable_voltage, switch_on_disabled},
    {7, ready_to_switch_on, Row::quick_stop, switch_on_disabled},
    {8, operation_enabled, Row::shutdown, ready_to_switch_on},
    {9, operation_enabled, Row::disable_voltage, switch_on_disabled},
    {10, switched_on, Row::disable_voltage, switch_on_disabled},
    {10, switched_on, Row::quick_stop, switch_on_disabled},
    {11, operation_enabled, Row::quick_stop, quick_stop_active},
    {12, quick_stop_active, Row::disable_voltage, switch_on_disabled},
};

struct Model {
  DriveState state;
  unsigned previous;

  void command(unsigned word, bool obstacle, bool cause_remains) {
    const auto rises = [&](unsigned bit) { return ((word & ~previous) & bit) != 0; };
    const bool resets = rises(0x80), enables = rises(0x08);
    previous = word;
    if (state == DriveState::fault) {
      if (resets && !cause_remains) state = switch_on_disabled;
      return;
    }
    for (const CommandRow& row : command_rows) {
      if ((word & row.mask) != row.value) continue;
      if (row.row == Row::enable_operation && !enables) return;
      // "Enable operation" in "ready to switch on" makes transitions 3 and 4.
      if (row.row == Row::enable_operation && state == ready_to_switch_on) state = switched_on;
      if (row.row == Row::enable_operation && obstacle) return;
      for (const Transition& t : transitions) {
        if (t.from == state && t.command == row.row) {
          state = t.to;
          return;
        }
      }
      return;
    }
  }
};

// A machine in `state` that saw `previous` last; nothing if no sequence leads there.
std::optional<AxisStateMachine> machine_in(DriveState state, std::uint16_t previous) {
  AxisStateMachine m;
  const auto say = [&m](std::uint16_t word, Refusal obstacle = Refusal::none) {
    m.command(word, obstacle, true);
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

// Words that set bits 3 and 7 of the previous word in each way, with the other bits in several ways.
constexpr std::uint16_t previous_words[] = {0x00, 0x02, 0x06, 0x07, 0x08, 0x0A, 0x0E, 0x0F,   0x80,
                                            0x82, 0x86, 0x87, 0x88, 0x8A, 0x8E, 0x8F, 0xFF70, 0xFFFF};

TEST(AxisStateMachine, EveryStateWithEveryControlwordFollowsTheStandardsTables) {
  int reached = 0;
  for (const DriveState state : all_states) {
    int previous_reached = 0;
    for (const std::uint16_t previous : previous_words) {
      const auto start = machine_in(state, previous);
      if (!start) continue;
      ++previous_reached;
      for (unsigned word = 0; word <= 0xFFFF; ++word) {
        for (const bool hindered : {false, true}) {
          AxisStateMachine machine = *start;
          Model model{state, previous};
          const auto obstacle = hindered ? Refusal::handle_inside_wall : Refusal::none;
          const bool asks = machine.asks_to_enable(static_cast<std::uint16_t>(word));
          machine.command(static_cast<std::uint16_t>(word), obstacle, hindered);
          model.command(word, hindered, hindered);
          ASSERT_EQ(machine.state(), model.state)
              << "from state " << int(state) << ", previous word " << previous << ", word " << word
              << ", hindered " << hindered;
          const bool became_enabled = state != operation_enabled && model.state == operation_enabled;
          if (!hindered) {
            ASSERT_EQ(asks, became_enabled) << int(state) << " " << previous << " " << word;
          }
          ASSERT_EQ(machine.armed(), machine.state() == operation_enabled);
          ++reached;
        }
      }
    }
    // The state must really have been visited, with bits 3 and 7 seen both ways where it can be.
    EXPECT_GE(previous_reached, 3) << int(state);
  }
  EXPECT_GT(reached, 8 * 3 * 2 * 65536);
}

TEST(AxisStateMachine, EnablingStraightFromSwitchOnDisabledDoesNothing) {
  AxisStateMachine m;
  m.initialised();
  for (int i = 0; i < 3; ++i) {
    m.command(0x0F, Refusal::none, false);
    EXPECT_EQ(m.state(), switch_on_disabled);
    EXPECT_EQ(m.refusal(), Refusal::none);
  }
  // Neither does it count as the edge of a later one: after shutdown a fresh edge is there again.
  m.command(0x06, Refusal::none, false);
  m.command(0x0F, Refusal::none, false);
  EXPECT_EQ(m.state(), operation_enabled);
}

TEST(AxisStateMachine, HeldWordAfterARefusalNeverArms) {
  for (const DriveState from : {ready_to_switch_on, switched_on}) {
    auto m = *machine_in(from, from == switched_on ? 0x07 : 0x06);
    m.command(0x0F, Refusal::handle_inside_wall, false);
    EXPECT_EQ(m.state(), switched_on);
    EXPECT_EQ(m.refusal(), Refusal::handle_inside_wall);
    // With the bits that do not matter changing, and through words that are no command.
    for (const unsigned word : {0x0Fu, 0x1Fu, 0xFF7Fu, 0x0Fu, 0x8Fu, 0x0Fu}) {
      m.command(static_cast<std::uint16_t>(word), Refusal::none, false);
      EXPECT_EQ(m.state(), switched_on) << word;
      EXPECT_EQ(m.refusal(), Refusal::handle_inside_wall);
    }
    m.command(0x07, Refusal::none, false);
    m.command(0x0F, Refusal::none, false);
    EXPECT_EQ(m.state(), operation_enabled);
    EXPECT_EQ(m.refusal(), Refusal::none);
  }
}

TEST(AxisStateMachine, FaultResetIsAnEdgeAndAHeldBitNeverResetsAgain) {
  auto m = *machine_in(operation_enabled, 0x0F);
  m.command(0x8F, Refusal::none, false);  // bit 7 was already up when the fault came
  m.trip(Fault::encoder);
  m.reaction_done();
  for (int i = 0; i < 3; ++i) {
    m.command(0x80, Refusal::none, false);
    EXPECT_EQ(m.state(), fault);
  }
  m.command(0x00, Refusal::none, false);
  EXPECT_EQ(m.state(), fault);
  m.command(0x80, Refusal::none, true);
  EXPECT_EQ(m.state(), fault) << "the cause remains";
  EXPECT_EQ(m.refusal(), Refusal::fault_present);
  EXPECT_EQ(m.fault(), Fault::encoder);
  m.command(0x80, Refusal::none, false);
  EXPECT_EQ(m.state(), fault) << "held, no edge";
  m.command(0x00, Refusal::none, false);
  m.command(0x80, Refusal::none, false);
  EXPECT_EQ(m.state(), switch_on_disabled);
  EXPECT_EQ(m.fault(), Fault::none);
  EXPECT_EQ(m.refusal(), Refusal::none);
}

TEST(AxisStateMachine, ResetEdgeDuringTheReactionIsNotKeptForLater) {
  auto m = *machine_in(fault_reaction_active, 0x00);
  m.command(0x80, Refusal::none, false);
  EXPECT_EQ(m.state(), fault_reaction_active);
  m.reaction_done();
  m.command(0x80, Refusal::none, false);
  EXPECT_EQ(m.state(), fault);
}

TEST(AxisStateMachine, TripsFromEveryStateAndTheFirstFaultIsKept) {
  for (const DriveState state : all_states) {
    auto m = *machine_in(state, state == operation_enabled ? 0x0F : state == switched_on ? 0x07 : 0x86);
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
    auto m = *machine_in(state, state == operation_enabled ? 0x0F : state == switched_on ? 0x07 : 0x86);
    auto other = m;
    m.initialised();
    EXPECT_EQ(m.state(), state == not_ready_to_switch_on ? switch_on_disabled : state);
    other.reaction_done();
    EXPECT_EQ(other.state(), state == fault_reaction_active ? fault : state);
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

// Whatever happens in whatever order, the machine agrees with the tables, and operation begins only with a
// rising bit 3 that is not refused.
RC_GTEST_PROP(AxisStateMachine, RandomHistoriesAgreeWithTheTables, ()) {
  AxisStateMachine machine;
  machine.initialised();
  Model model{switch_on_disabled, 0};
  const auto steps = *rc::gen::inRange(1, 60);
  for (int i = 0; i < steps; ++i) {
    const DriveState before = machine.state();
    const auto event = *rc::gen::inRange(0, 12);
    if (event == 0) {
      machine.trip(Fault::over_speed);
      if (model.state != fault) model.state = fault_reaction_active;
    } else if (event == 1) {
      machine.reaction_done();
      if (model.state == fault_reaction_active) model.state = fault;
    } else {
      const auto word = *rc::gen::oneOf(
          rc::gen::element<std::uint16_t>(0x00, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x80, 0x8F, 0x0E, 0x1F),
          rc::gen::arbitrary<std::uint16_t>());
      const bool hindered = *rc::gen::inRange(0, 3) == 0;
      const unsigned previous = model.previous;
      machine.command(word, hindered ? Refusal::handle_inside_wall : Refusal::none, hindered);
      model.command(word, hindered, hindered);
      if (before != operation_enabled && machine.armed())
        RC_ASSERT((word & 0x08) != 0 && (previous & 0x08) == 0 && !hindered);
    }
    RC_ASSERT(machine.state() == model.state);
    RC_ASSERT((machine.fault() != Fault::none) ==
              (model.state == fault || model.state == fault_reaction_active));
  }
}

}  // namespace
}  // namespace kmax::firmware
