// Sequences of commands and events; single commands are in axis_state_machine_test.cpp.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "tests/firmware/drive/drive_model.hpp"

namespace kmax::firmware::axis_state_machine_histories_test {
namespace {

using enum DriveState;

rc::Gen<std::uint16_t> some_word() {
  return rc::gen::oneOf(rc::gen::element<std::uint16_t>(0x00, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x80, 0x8F, 0x0E,
                                                        0x1F, 0x106, 0x10F),
                        rc::gen::arbitrary<std::uint16_t>());
}

// Whatever happens in whatever order, the machine agrees with the tables, and there is force only after a
// bit 3 that rose since it was last refused, taken away or lost to a fault.
RC_GTEST_PROP(AxisStateMachine, RandomHistoriesAgreeWithTheTables, ()) {
  AxisStateMachine machine;
  DriveModel model;
  bool fresh_edge = false;
  const auto steps = *rc::gen::inRange(1, 80);
  for (int i = 0; i < steps; ++i) {
    const DriveState before = machine.state();
    const auto event = *rc::gen::inRange(0, 14);
    if (event == 0) {
      machine.trip(Fault::over_speed);
      if (model.state != fault) model.state = fault_reaction_active;
      fresh_edge = false;
    } else if (event == 1) {
      machine.reaction_done();
      if (model.state == fault_reaction_active) model.state = fault;
    } else if (event == 2) {
      machine.initialised();
      if (model.state == not_ready_to_switch_on) model.state = switch_on_disabled;
    } else {
      const auto word = *some_word();
      const auto obstacle = *rc::gen::element(Refusal::none, Refusal::none, Refusal::handle_inside_wall);
      const bool cause_remains = *rc::gen::arbitrary<bool>(), stays = *rc::gen::arbitrary<bool>();
      const bool rises = (word & 0x08) != 0 && (model.previous & 0x08) == 0;
      machine.command(word, Link::serial, obstacle, cause_remains, {.stay_in_quick_stop = stays});
      model.command(word, obstacle, cause_remains, stays);
      if (before != operation_enabled) fresh_edge = rises && obstacle == Refusal::none;
      if (machine.armed()) RC_ASSERT(fresh_edge);
    }
    RC_ASSERT(machine.state() == model.state);
    RC_ASSERT(machine.refusal() == model.refusal);
    RC_ASSERT((machine.fault() != Fault::none) ==
              (model.state == fault || model.state == fault_reaction_active));
    // From no force to force by commands only.
    if (before != operation_enabled && machine.armed()) RC_ASSERT(event > 2);
  }
}

// A word that is held, whatever its other bits do, is one edge: it neither arms nor resets a second time.
RC_GTEST_PROP(AxisStateMachine, BitsThatAreHeldNeverActAgain, ()) {
  const auto held = *rc::gen::element<std::uint16_t>(0x08, 0x80, 0x88);
  AxisStateMachine machine;
  machine.initialised();
  for (const std::uint16_t word : std::initializer_list<std::uint16_t>{0x06, 0x07, 0x0F})
    machine.command(word, Link::serial, Refusal::none, false);
  RC_ASSERT(machine.armed());
  machine.command(held, Link::serial, Refusal::none, false);
  machine.trip(Fault::encoder);
  machine.reaction_done();
  const bool holds_reset = (held & 0x80) != 0;
  if (!holds_reset) {
    machine.command(static_cast<std::uint16_t>(0x80 | held), Link::serial, Refusal::none, false);
    RC_ASSERT(machine.state() == switch_on_disabled);
  }
  const auto steps = *rc::gen::inRange(1, 40);
  for (int i = 0; i < steps; ++i) {
    machine.command(static_cast<std::uint16_t>(*some_word() | held), Link::serial, Refusal::none, false,
                    {.stay_in_quick_stop = *rc::gen::arbitrary<bool>()});
    RC_ASSERT(!machine.armed());
    if (holds_reset) RC_ASSERT(machine.state() == fault);
  }
}

// All that can be reached at all: every state, by every event in it, from the beginning. Between two states
// nothing but what the standard's figure draws, with its numbers.
TEST(AxisStateMachine, EveryStateIsReachedAndOnlyAsTheStandardDraws) {
  struct Node {
    AxisStateMachine machine;
    unsigned previous;
  };
  using Key = std::tuple<DriveState, unsigned, Refusal>;
  std::map<Key, Node> found;
  std::vector<Key> open;
  std::set<std::pair<DriveState, DriveState>> moves;
  const auto visit = [&](const Node& from, const AxisStateMachine& to, unsigned previous) {
    if (from.machine.state() != to.state()) moves.insert({from.machine.state(), to.state()});
    const Key key{to.state(), previous & 0x88u, to.refusal()};
    if (found.insert({key, {to, previous}}).second) open.push_back(key);
  };
  visit({}, AxisStateMachine{}, 0);
  while (!open.empty()) {
    const Node node = found.at(open.back());
    open.pop_back();
    AxisStateMachine next = node.machine;
    next.initialised();
    visit(node, next, node.previous);
    next = node.machine;
    next.trip(Fault::link_silent);
    visit(node, next, node.previous);
    next = node.machine;
    next.reaction_done();
    visit(node, next, node.previous);
    for (unsigned word = 0; word < 0x200; ++word) {
      for (unsigned conditions = 0; conditions < 8; ++conditions) {
        next = node.machine;
        next.command(static_cast<std::uint16_t>(word), Link::serial,
                     (conditions & 1) != 0 ? Refusal::handle_inside_wall : Refusal::none,
                     (conditions & 2) != 0, {.stay_in_quick_stop = (conditions & 4) != 0});
        visit(node, next, word);
      }
    }
  }
  const std::set<std::pair<DriveState, DriveState>> drawn = {
      {not_ready_to_switch_on, switch_on_disabled},     // 1
      {switch_on_disabled, ready_to_switch_on},         // 2
      {ready_to_switch_on, switched_on},                // 3
      {switched_on, operation_enabled},                 // 4
      {operation_enabled, switched_on},                 // 5
      {switched_on, ready_to_switch_on},                // 6
      {ready_to_switch_on, switch_on_disabled},         // 7
      {operation_enabled, ready_to_switch_on},          // 8
      {operation_enabled, switch_on_disabled},          // 9, or 11 and 12
      {switched_on, switch_on_disabled},                // 10
      {operation_enabled, quick_stop_active},           // 11
      {quick_stop_active, switch_on_disabled},          // 12
      {not_ready_to_switch_on, fault_reaction_active},  // 13, from every state without a fault
      {switch_on_disabled, fault_reaction_active},
      {ready_to_switch_on, fault_reaction_active},
      {switched_on, fault_reaction_active},
      {operation_enabled, fault_reaction_active},
      {quick_stop_active, fault_reaction_active},
      {fault_reaction_active, fault},           // 14
      {fault, switch_on_disabled},              // 15
      {ready_to_switch_on, operation_enabled},  // 3 and 4
  };
  EXPECT_EQ(moves, drawn);
}

}  // namespace
}  // namespace kmax::firmware::axis_state_machine_histories_test
