// Setpoints and CANopen's own settings in ParameterAccess: what is taken at once and is no part of a set.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string_view>
#include <vector>

#include "firmware/parameters/persistent_parameters.hpp"
#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::parameter_access_setpoints_test {
namespace {

using Setpoints = NamedParameters;
using Communication = NamedParameters;

TEST_F(Setpoints, EveryPatternOfTheTargetIsANumberWithItsSign) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    ASSERT_EQ(write("profile.target_torque", {static_cast<std::uint16_t>(word)}, true, 1), Refusal::none);
    const int number = word < 0x8000 ? static_cast<int>(word) : static_cast<int>(word) - 0x10000;
    ASSERT_EQ(registers.values().whole<"profile.target_torque">(1), number);
    ASSERT_EQ(get("profile.target_torque", 1), number) << "and it reads back as it was written";
  }
  EXPECT_EQ(registers.values().whole<"profile.target_torque">(0), 0);
}

TEST_F(Setpoints, OptionsOf16BitsTakeTheirNumberAndNothingThatLooksLikeItIn8) {
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    const auto sent = static_cast<std::uint16_t>(word);
    ASSERT_EQ(write("profile.quick_stop_option", {sent}),
              word == 0 || word == 6 ? Refusal::none : Refusal::not_a_choice)
        << word;
    ASSERT_EQ(write("profile.halt_option", {sent}), word == 1 ? Refusal::none : Refusal::not_a_choice)
        << word;
    ASSERT_EQ(write("profile.fault_option", {sent}), word == 0 ? Refusal::none : Refusal::not_a_choice)
        << word;
  }
}

TEST_F(Setpoints, AreTakenAtOnceAndAreNoChangeOfParameters) {
  for (const bool armed : {false, true}) {
    EXPECT_EQ(write("profile.target_torque", {0xFF38}, armed), Refusal::none);
    EXPECT_EQ(write("profile.max_torque", {1500}, armed), Refusal::none);
    EXPECT_EQ(get("profile.target_torque"), -200);
    EXPECT_EQ(get("profile.max_torque"), 1500);
    // Both in one message.
    EXPECT_EQ(write("profile.target_torque", {300, 700}, armed, 1), Refusal::none);
    EXPECT_EQ(get("profile.target_torque", 1), 300);
    EXPECT_EQ(get("profile.max_torque", 1), 700);
  }
  EXPECT_EQ(registers.changes(), 0u);
  EXPECT_EQ(registers.restarting_changes(), 0u);
}

TEST_F(Setpoints, OneOfTwoRegistersIsTakenWholeOrNotAtAll) {
  for (const bool armed : {false, true}) {
    const double newtons = armed ? -2.5 : 1.25;
    EXPECT_EQ(write("profile.target_force", words_for("profile.target_force", newtons), armed),
              Refusal::none);
    EXPECT_EQ(get("profile.target_force"), newtons);
  }
  EXPECT_EQ(registers.changes(), 0u);
  EXPECT_EQ(write("profile.target_force", {0x3F80}), Refusal::value_cut_in_two);
  EXPECT_EQ(write("profile.target_force", words_for("profile.target_force", 1001)), Refusal::out_of_range);
  EXPECT_EQ(write("profile.target_force", words_of_float(std::nanf(""))), Refusal::not_finite);
  const auto second = static_cast<std::uint16_t>(address_of("profile.target_force") + 1);
  EXPECT_EQ(registers.write(second, Words{0}, false, now).refusal, Refusal::value_cut_in_two);
  EXPECT_EQ(get("profile.target_force"), -2.5);
}

TEST_F(Setpoints, OutOfRangeIsRefusedAndOfTwoNeitherIsTaken) {
  ASSERT_EQ(write("profile.target_torque", {10, 20}), Refusal::none);
  for (const unsigned word : {0x8000u, 0xFFFFu}) {
    EXPECT_EQ(write("profile.max_torque", {static_cast<std::uint16_t>(word)}), Refusal::out_of_range);
    EXPECT_EQ(registers.last_refusal().address, address_of("profile.max_torque"));
    EXPECT_EQ(write("profile.target_torque", {11, static_cast<std::uint16_t>(word)}), Refusal::out_of_range);
    EXPECT_EQ(registers.last_refusal().address, address_of("profile.max_torque"));
    EXPECT_EQ(registers.last_refusal().refusal, Refusal::out_of_range);
  }
  EXPECT_EQ(get("profile.target_torque"), 10);
  EXPECT_EQ(get("profile.max_torque"), 20);
  EXPECT_EQ(write("profile.target_torque", {12}), Refusal::none);
  EXPECT_EQ(registers.last_refusal().refusal, Refusal::none);
}

TEST_F(Setpoints, InATransactionTheyActAtOnceAndTheCommitLeavesTheLatest) {
  ASSERT_EQ(control(1), Refusal::none);
  EXPECT_EQ(write("profile.target_torque", {100}), Refusal::none);
  EXPECT_EQ(get("profile.target_torque"), 100);
  EXPECT_EQ(write("wall.stiffness", words_for("wall.stiffness", 5000)), Refusal::none);
  // A range with a parameter on either side: they wait, the setpoints do not.
  EXPECT_EQ(write("profile.operation_mode", {10, 200, 900, 0xC0}), Refusal::none);
  EXPECT_EQ(get("profile.target_torque"), 200);
  EXPECT_EQ(get("profile.max_torque"), 900);
  EXPECT_EQ(get("profile.operation_mode"), -1);
  EXPECT_EQ(get("profile.polarity"), 0);
  // One that is refused takes no setpoint either.
  EXPECT_EQ(write("profile.operation_mode", {10, 201, 901, 1}), Refusal::not_a_choice);
  EXPECT_EQ(get("profile.target_torque"), 200);
  EXPECT_EQ(write("profile.target_torque", {300}), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("profile.target_torque"), 300);
  EXPECT_EQ(get("profile.operation_mode"), 10);
  EXPECT_EQ(get("profile.polarity"), 0xC0);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(registers.changes(), 1u);
}

TEST_F(Setpoints, NeitherKeepATransactionAliveNorWaitForItsStragglers) {
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(write("wall.stiffness", words_for("wall.stiffness", 5000)), Refusal::none);
  for (int i = 0; i < 3; ++i) {
    now += 700'000;
    EXPECT_EQ(write("profile.target_torque", {static_cast<std::uint16_t>(i)}), Refusal::none);
  }
  EXPECT_FALSE(registers.transaction_open());
  EXPECT_EQ(write("profile.target_torque", {77}), Refusal::none)
      << "a setpoint has no part in what was dropped";
  EXPECT_EQ(get("profile.target_torque"), 77);
  EXPECT_EQ(write("profile.operation_mode", {10, 78}), Refusal::no_transaction);
  EXPECT_EQ(get("profile.target_torque"), 77);
  EXPECT_EQ(control(2), Refusal::no_transaction);
}

TEST_F(Setpoints, AndCommandsAreNoPartOfASetOfParameters) {
  ASSERT_EQ(write("profile.target_torque", {10, 20}), Refusal::none);
  ASSERT_EQ(write("drive.controlword", {0x06}), Refusal::none);
  ParameterValues wanted;
  wanted.set_whole<"drive.controlword">(0x0F);
  wanted.set_whole<"profile.target_torque">(500);
  wanted.set_real<"wall.stiffness">(5000.0f);
  ASSERT_EQ(registers.set_all(wanted, false).refusal, Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(get("profile.target_torque"), 10);
  EXPECT_EQ(get("profile.max_torque"), 20);
  EXPECT_EQ(get("drive.controlword"), 6);
  EXPECT_EQ(registers.changes(), 1u);
}

// docs/who_may_do_what.md: a locked device still does what moves nothing but values on their way.
TEST_F(Setpoints, LockedOnlySetpointsAndWhatMeasuresAreTaken) {
  EXPECT_FALSE(registers.locked());
  registers.set_locked(true);
  EXPECT_TRUE(registers.locked());
  const auto before = registers.bits();
  EXPECT_EQ(set("wall.stiffness", 900), Refusal::locked);
  EXPECT_EQ(set("node.id", 5), Refusal::locked);
  EXPECT_EQ(set("excitation.run", 5), Refusal::locked);
  EXPECT_EQ(registers.bits(), before);
  EXPECT_EQ(set("wall.stiffness", 1000), Refusal::none) << "as it is";
  for (const std::string_view name : {"drive.controlword", "drive.commander", "link.sign_of_life"})
    EXPECT_EQ(set(name, 7), Refusal::none) << name;
  for (const std::string_view name : {"trace.interval", "trace.axis", "capture.axis", "capture.samples"})
    EXPECT_EQ(set(name, 1), Refusal::none) << name;
  const std::size_t heartbeat = slot_of(entry_of<"canopen.heartbeat_time">(), 0);
  EXPECT_EQ(registers.write_communication(heartbeat, 123, false).refusal, Refusal::locked);
  registers.set_locked(false);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 900), Refusal::none);
  registers.set_locked(true);
  EXPECT_EQ(control(2), Refusal::locked) << "locked since";
  EXPECT_EQ(get("wall.stiffness"), 1000);
  ParameterValues wanted = registers.values();
  wanted.set_real<"wall.stiffness">(800.0f);
  EXPECT_EQ(registers.set_all(wanted, false).refusal, Refusal::none) << "the board's own are no host's";
  EXPECT_EQ(get("wall.stiffness"), 800);
}

TEST_F(Communication, SettingsAreSetOneByOneWithinTheirRangeAndCountedApart) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.access != Access::communication) continue;
    const std::uint32_t counted = registers.communication_changes();
    const std::size_t place = slot_of(i, 0);
    const std::uint32_t value = e.default_value == e.maximum ? 0 : raw_from_number(e.type, e.maximum);
    EXPECT_EQ(registers.write_communication(place, value, false).refusal, Refusal::none) << e.name;
    EXPECT_EQ(registers.values().raw(place), value) << e.name;
    EXPECT_EQ(registers.communication_changes(), counted + 1) << e.name;
    EXPECT_EQ(registers.write_communication(place, value, false).refusal, Refusal::none) << e.name;
    EXPECT_EQ(registers.communication_changes(), counted + 1) << e.name << ": no change";
    if (e.maximum < 4294967295.0) {
      const auto result =
          registers.write_communication(place, static_cast<std::uint32_t>(e.maximum) + 1, false);
      EXPECT_EQ(result.refusal, Refusal::out_of_range) << e.name;
      EXPECT_EQ(result.address, modbus_address(i, 0));
      EXPECT_EQ(registers.last_refusal().refusal, Refusal::out_of_range);
      EXPECT_EQ(registers.values().raw(place), value) << e.name;
      EXPECT_EQ(registers.communication_changes(), counted + 1) << e.name;
    }
    // Any link reads it, among the readings.
    Words words(register_count(e.type));
    ASSERT_TRUE(modbus::readable(false, modbus_address(i, 0), words.size())) << e.name;
    registers.read(false, modbus_address(i, 0), words);
    EXPECT_EQ(words, words_of_raw(e.type, value)) << e.name;
  }
  EXPECT_EQ(registers.changes(), 0u);
}

TEST_F(Communication, IsNotWrittenAsARegisterAndNothingElseIsWrittenAsIt) {
  for (std::size_t place = 0; place < slot_count; ++place) {
    const auto [entry, axis] = owner_of(place);
    const Entry& e = entry_at(entry);
    const std::uint32_t before = registers.values().raw(place);
    if (e.access == Access::communication) {
      EXPECT_EQ(registers.write(modbus_address(entry, axis), words_of_raw(e.type, 1), false, now).refusal,
                Refusal::unknown_register)
          << e.name;
    } else {
      const auto result = registers.write_communication(place, 1, false);
      EXPECT_EQ(result.refusal, Refusal::read_only) << e.name;
      EXPECT_EQ(result.address, modbus_address(entry, axis)) << e.name;
    }
    EXPECT_EQ(registers.values().raw(place), before) << e.name;
  }
  EXPECT_EQ(registers.communication_changes(), 0u);
}

TEST_F(Communication, OfASetIsTakenWithItAndCountedOnce) {
  ParameterValues wanted = registers.values();
  wanted.set_whole<"canopen.heartbeat_time">(100);
  wanted.set_whole<"tpdo1.event_time">(5);
  ASSERT_EQ(registers.set_all(wanted, true).refusal, Refusal::none);
  EXPECT_EQ(get("canopen.heartbeat_time"), 100);
  EXPECT_EQ(get("tpdo1.event_time"), 5);
  EXPECT_EQ(registers.communication_changes(), 1u);
  EXPECT_EQ(registers.changes(), 0u) << "none of the axes' settings has changed";
  wanted.set_real<"wall.stiffness">(5000.0f);
  ASSERT_EQ(registers.set_all(wanted, false).refusal, Refusal::none);
  EXPECT_EQ(registers.communication_changes(), 1u);
  EXPECT_EQ(registers.changes(), 1u);
  // Refused whole.
  wanted.set_whole<"canopen.heartbeat_time">(200);
  wanted.set_real<"wall.position">(1.0f);
  EXPECT_EQ(registers.set_all(wanted, true).refusal, Refusal::while_armed);
  EXPECT_EQ(get("canopen.heartbeat_time"), 100);
  EXPECT_EQ(registers.communication_changes(), 1u);
  set_defaults(wanted);
  ASSERT_EQ(registers.set_all(wanted, false).refusal, Refusal::none);
  EXPECT_EQ(get("canopen.heartbeat_time"), 0);
  EXPECT_EQ(registers.communication_changes(), 2u);
}

TEST_F(Communication, SetDuringATransactionStaysAtItsCommit) {
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(write("wall.stiffness", words_for("wall.stiffness", 5000)), Refusal::none);
  ASSERT_EQ(
      registers.write_communication(slot_of(entry_of<"canopen.heartbeat_time">(), 0), 100, false).refusal,
      Refusal::none);
  ASSERT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("canopen.heartbeat_time"), 100);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(registers.communication_changes(), 1u);
}

}  // namespace
}  // namespace kmax::firmware::parameter_access_setpoints_test
