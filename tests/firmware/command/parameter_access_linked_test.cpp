// Parameters that are one thing in two standards' numbers, as ParameterAccess keeps them together; which
// those are is in linked_parameters_test.cpp.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string_view>
#include <utility>
#include <vector>

#include "firmware/drive/axes_law.hpp"
#include "firmware/parameters/persistent_parameters.hpp"
#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::parameter_access_linked_test {
namespace {

struct Pair {
  std::string_view own, standard;
  std::vector<std::pair<int, int>> values;
};
const std::vector<Pair> pairs = {{"drive.mode", "profile.operation_mode", {{0, -1}, {1, -2}, {2, 10}}},
                                 {"encoder.direction", "profile.polarity", {{1, 0}, {-1, 0xC0}}}};

class LinkedRegisters : public NamedParameters {
 protected:
  ParameterValues with(std::initializer_list<std::pair<std::string_view, int>> numbers,
                       std::size_t axis = 0) {
    ParameterValues values = registers.values();
    for (const auto& [name, number] : numbers)
      values.set_raw(slot_of(entry_named(name), axis), static_cast<std::uint32_t>(number));
    return values;
  }
};

TEST_F(LinkedRegisters, WritingEitherSetsBothAndIsOneChange) {
  for (const Pair& pair : pairs) {
    for (const std::size_t axis : {0u, 1u}) {
      for (const bool by_standard : {false, true}) {
        for (const auto& [own, standard] : pair.values) {
          const auto changes = registers.changes(), restarts = registers.restarting_changes();
          const bool changed = get(pair.own, axis) != own;
          ASSERT_EQ(by_standard ? set(pair.standard, standard, false, axis) : set(pair.own, own, false, axis),
                    Refusal::none);
          EXPECT_EQ(get(pair.own, axis), own);
          EXPECT_EQ(get(pair.standard, axis), standard);
          EXPECT_EQ(registers.changes(), changes + (changed ? 1 : 0));
          EXPECT_EQ(registers.restarting_changes(), restarts + (changed ? 1 : 0));
        }
      }
      EXPECT_EQ(get(pair.own, axis_along<axis_count>(axis)),
                axis == 0 ? pair.values[0].first : pair.values.back().first)
          << "of the other axis nothing";
    }
  }
}

TEST_F(LinkedRegisters, WhatIsNoChoiceOrNotAllowedWhileArmedChangesNeither) {
  for (const double wrong : {-3, 0, 1, 2, 3, 6, 7, 8, 9, 11})
    EXPECT_EQ(set("profile.operation_mode", wrong), Refusal::not_a_choice) << wrong;
  for (const double wrong : {1, 0x40, 0x80, 0xC1, 0xFF})
    EXPECT_EQ(set("profile.polarity", wrong), Refusal::not_a_choice) << wrong;
  EXPECT_EQ(set("profile.operation_mode", 10, true), Refusal::while_armed);
  EXPECT_EQ(set("profile.polarity", 0xC0, true), Refusal::while_armed);
  EXPECT_EQ(set("profile.operation_mode", -1, true), Refusal::none) << "what it is already";
  EXPECT_EQ(get("drive.mode"), 0);
  EXPECT_EQ(get("profile.operation_mode"), -1);
  EXPECT_EQ(get("encoder.direction"), 1);
  EXPECT_EQ(get("profile.polarity"), 0);
  EXPECT_EQ(registers.changes(), 0u);
}

TEST_F(LinkedRegisters, ARangeThatCoversOneOfThemSetsTheOtherToo) {
  // From profile.operation_mode on: mode, two setpoints, polarity.
  ASSERT_EQ(
      registers.write(address_of("profile.operation_mode", 1), Words{10, 100, 900, 0xC0}, false, now).refusal,
      Refusal::none);
  EXPECT_EQ(get("drive.mode", 1), 2);
  EXPECT_EQ(get("encoder.direction", 1), -1);
  EXPECT_EQ(get("profile.target_torque", 1), 100);
  EXPECT_EQ(get("profile.max_torque", 1), 900);
  EXPECT_EQ(registers.changes(), 1u);
  // Refused whole for its last value.
  EXPECT_EQ(
      registers.write(address_of("profile.operation_mode", 1), Words{0xFFFF, 7, 8, 1}, false, now).refusal,
      Refusal::not_a_choice);
  EXPECT_EQ(get("drive.mode", 1), 2);
  EXPECT_EQ(get("profile.target_torque", 1), 100);
}

TEST_F(LinkedRegisters, InATransactionTheLastOneWrittenWins) {
  for (const bool standard_last : {false, true}) {
    registers = {};
    ASSERT_EQ(control(1), Refusal::none);
    for (const bool standard : {!standard_last, standard_last}) {
      EXPECT_EQ(standard ? set("profile.operation_mode", 10) : set("drive.mode", 1), Refusal::none);
      EXPECT_EQ(standard ? set("profile.polarity", 0xC0) : set("encoder.direction", 1), Refusal::none);
      EXPECT_EQ(get("drive.mode"), 0) << "not before the commit";
      EXPECT_EQ(get("encoder.direction"), 1);
    }
    ASSERT_EQ(control(2), Refusal::none);
    EXPECT_EQ(get("drive.mode"), standard_last ? 2 : 1);
    EXPECT_EQ(get("profile.operation_mode"), standard_last ? 10 : -2);
    EXPECT_EQ(get("encoder.direction"), standard_last ? -1 : 1);
    EXPECT_EQ(get("profile.polarity"), standard_last ? 0xC0 : 0);
  }
}

TEST_F(LinkedRegisters, ACommitWhileArmedIsRefusedForEither) {
  for (const std::string_view name : {"profile.operation_mode", "drive.mode"}) {
    registers = {};
    ASSERT_EQ(control(1), Refusal::none);
    ASSERT_EQ(set(name, name == "drive.mode" ? 2 : 10), Refusal::none);
    EXPECT_EQ(control(2, true), Refusal::while_armed);
    EXPECT_EQ(get("drive.mode"), 0);
    EXPECT_EQ(get("profile.operation_mode"), -1);
  }
}

TEST_F(LinkedRegisters, OfASetTheOneThatDiffersFromNowWinsAndElseThePersistentOne) {
  ASSERT_EQ(registers.set_all(with({{"profile.polarity", 0xC0}}), false).refusal, Refusal::none);
  EXPECT_EQ(get("encoder.direction"), -1);
  EXPECT_EQ(registers.restarting_changes(), 1u);
  ASSERT_EQ(registers.set_all(with({{"encoder.direction", 1}}), false).refusal, Refusal::none);
  EXPECT_EQ(get("profile.polarity"), 0);
  // Both, and not the same.
  ASSERT_EQ(registers.set_all(with({{"drive.mode", 1}, {"profile.operation_mode", 10}}), false).refusal,
            Refusal::none);
  EXPECT_EQ(get("drive.mode"), 1);
  EXPECT_EQ(get("profile.operation_mode"), -2);
  // A set that is the present one changes nothing.
  const auto changes = registers.changes();
  ASSERT_EQ(registers.set_all(registers.values(), true).refusal, Refusal::none);
  EXPECT_EQ(registers.changes(), changes);
  EXPECT_EQ(registers.set_all(with({{"profile.polarity", 0xC0}}), true).refusal, Refusal::while_armed);
  EXPECT_EQ(get("encoder.direction"), 1);
}

TEST_F(LinkedRegisters, AgreeAfterTheDefaults) {
  ASSERT_EQ(set("profile.polarity", 0xC0, false, 1), Refusal::none);
  ASSERT_EQ(set("profile.operation_mode", 10, false, 1), Refusal::none);
  ParameterValues wanted = registers.values();
  set_defaults(wanted);
  ASSERT_EQ(registers.set_all(wanted, false).refusal, Refusal::none);
  EXPECT_EQ(get("encoder.direction", 1), 1);
  EXPECT_EQ(get("profile.polarity", 1), 0);
  EXPECT_EQ(get("drive.mode", 1), 2) << "no persistent value, and so none of the defaults'";
  EXPECT_EQ(get("profile.operation_mode", 1), 10);
}

RC_GTEST_PROP(LinkedParametersOfRegisters, AlwaysAgreeWhateverIsDone, ()) {
  RegisterAccess registers;
  const auto steps = *rc::gen::inRange(1, 60);
  std::uint32_t now = 0;
  for (int step = 0; step < steps; ++step) {
    now += *rc::gen::inRange<std::uint32_t>(0, 1'500'000);
    const Pair& pair = pairs[*rc::gen::inRange<std::size_t>(0, pairs.size())];
    const std::size_t axis = *rc::gen::inRange<std::size_t>(0, axis_count);
    const auto& [own, standard] = pair.values[*rc::gen::inRange<std::size_t>(0, pair.values.size())];
    const bool armed = *rc::gen::inRange(0, 4) == 0;
    switch (*rc::gen::inRange(0, 4)) {
      case 0:
        registers.write(address_of(pair.own, axis), words_for(pair.own, own), armed, now);
        break;
      case 1:
        registers.write(address_of(pair.standard, axis), words_for(pair.standard, standard), armed, now);
        break;
      case 2:
        registers.write(address_of("transaction.control"), Words{*rc::gen::inRange<std::uint16_t>(0, 3)},
                        armed, now);
        break;
      default: {
        ParameterValues wanted = registers.values();
        wanted.set_raw(slot_of(entry_named(pair.own), axis), static_cast<std::uint32_t>(own));
        if (*rc::gen::arbitrary<bool>())
          wanted.set_raw(slot_of(entry_named(pair.standard), axis), static_cast<std::uint32_t>(standard));
        registers.set_all(wanted, armed);
      }
    }
    for (const Pair& each : pairs) {
      for (const std::size_t a : {0u, 1u}) {
        const auto number = [&](std::string_view name) {
          return static_cast<std::int32_t>(registers.values().raw(slot_of(entry_named(name), a)));
        };
        bool agree = false;
        for (const auto& [x, y] : each.values)
          agree = agree || (number(each.own) == x && number(each.standard) == y);
        RC_ASSERT(agree);
      }
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::parameter_access_linked_test
