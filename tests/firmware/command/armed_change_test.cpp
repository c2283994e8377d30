// What may change while an axis is armed; that nothing else may, parameter_access_test.cpp tries for every
// entry from its default.
#include "firmware/command/armed_change.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::armed_change_test {
namespace {

constexpr ArmedAxes only(std::size_t axis, Link commander = Link::serial) {
  ArmedAxes armed;
  armed.axis[axis] = true;
  armed.commander[axis] = commander;
  return armed;
}

class WhileArmed : public NamedParameters {
 protected:
  Refusal set_armed(std::string_view name, double number, std::size_t axis = 0,
                    const ArmedAxes& armed = only(0), Link by = Link::serial) {
    return registers.write(address_of(name, axis), words_for(name, number), armed, now, by).refusal;
  }
};

// What the world's other nodes could do to a hand on the device, each value by itself.
TEST_F(WhileArmed, NothingThatProtectsIsTakenAwayOverAnyLink) {
  const struct {
    std::string_view name;
    double number;
    Refusal refusal = Refusal::only_tightens;
  } attacks[] = {{"force.limit", 1000},
                 {"wall.stiffness", 1e6},
                 {"wall.damping", 1000},
                 {"wall.magnetic_coefficient", 100},
                 {"wall.magnetic_length", 1e-6, Refusal::while_armed},
                 {"wall.magnetic_length", 1, Refusal::while_armed},
                 {"wall.adaptive_force_min", 2},
                 {"wall.adaptive_force_max", 100},
                 {"velocity.limit", 0},
                 {"velocity.limit", 1000},
                 {"supply.voltage_max", 100},
                 {"supply.voltage_min", 0},
                 {"temperature.limit", 200},
                 {"temperature.motor_limit", 0},
                 {"temperature.derating", 0},
                 {"temperature.ambient", -40},
                 {"temperature.winding_capacity", 1e5, Refusal::while_armed},
                 {"temperature.winding_capacity", 0.01, Refusal::while_armed},
                 {"temperature.winding_resistance", 0.01},
                 {"temperature.case_capacity", 1e6, Refusal::while_armed},
                 {"temperature.case_capacity", 0.01, Refusal::while_armed},
                 {"temperature.case_resistance", 0.01},
                 {"interference.background_force", -100},
                 {"interference.background_force", 100},
                 {"interference.force", 100},
                 {"force.ramp_time", 0},
                 {"guard.damping", 1000},
                 {"guard.friction", 100},
                 {"excitation.travel", 1},
                 {"instability.action", 0},
                 {"instability.force", 1000},
                 {"instability.amplitude", 1},
                 {"modbus.unit", 9, Refusal::while_armed},
                 {"modbus.baud_rate", 9600, Refusal::while_armed},
                 {"link.timeout", 0, Refusal::while_armed},
                 {"link.timeout", 0.5, Refusal::while_armed},
                 {"supply.brake_voltage", 50, Refusal::while_armed},
                 {"current.limit", 120, Refusal::while_armed},
                 {"current.bandwidth", 1, Refusal::while_armed},
                 {"force.ceiling", 1000, Refusal::while_armed},
                 {"wall.stiffness_ceiling", 1e6, Refusal::while_armed},
                 {"wall.damping_ceiling", 1000, Refusal::while_armed}};
  for (const Link by : {Link::serial, Link::can, Link::local}) {
    for (const auto& attack : attacks) {
      EXPECT_EQ(set_armed(attack.name, attack.number, 0, only(0, by), by), attack.refusal)
          << attack.name << " = " << attack.number;
      EXPECT_EQ(registers.last_refusal().address, address_of(attack.name)) << attack.name;
    }
  }
  EXPECT_EQ(registers.changes(), 0u);
}

TEST_F(WhileArmed, AnotherLinkMayDisarmAndNotArmAgain) {
  const ParameterValues values;
  for (const std::size_t axis : {0U, 1U}) {
    for (const Link by : {Link::serial, Link::can, Link::local}) {
      const bool is_anothers = axis == 0 && by == Link::serial;
      for (std::uint32_t word = 0; word < 0x200; ++word) {
        const SlotValue wanted{static_cast<std::uint16_t>(slot_of(entry_of<"drive.controlword">(), axis)),
                               word};
        EXPECT_EQ(armed_change_refusal(values, wanted, by, only(0, Link::can)),
                  is_anothers && (word & 0x8F) == 0x0F ? Refusal::other_commander : Refusal::none)
            << axis << ' ' << static_cast<int>(by) << ' ' << word;
      }
    }
  }
}

TEST_F(WhileArmed, ABoundThatIsOffCanBeSwitchedOnAndNotOffAgain) {
  ASSERT_EQ(set("velocity.limit", 0), Refusal::none);
  EXPECT_EQ(set_armed("velocity.limit", 1000), Refusal::none);
  EXPECT_EQ(set_armed("velocity.limit", 2), Refusal::none);
  EXPECT_EQ(set_armed("velocity.limit", 3), Refusal::only_tightens);
  EXPECT_EQ(set_armed("velocity.limit", 0), Refusal::only_tightens);
  EXPECT_EQ(set_armed("force.slew_limit", 1e9), Refusal::none) << "0 is no limit";
  EXPECT_EQ(set_armed("force.slew_limit", 0), Refusal::only_tightens);
  EXPECT_EQ(set_armed("force.limit", 0), Refusal::none) << "this 0 is the tightest";
}

TEST_F(WhileArmed, ADeviceMayBeMadeToDoMoreAboutAnOscillation) {
  for (const int action : {0, 1, 2, 3}) {
    for (const int wanted : {0, 1, 2, 3}) {
      ASSERT_EQ(set("instability.action", action), Refusal::none);
      EXPECT_EQ(set_armed("instability.action", wanted),
                wanted < action ? Refusal::only_tightens : Refusal::none)
          << action << " to " << wanted;
    }
  }
  EXPECT_EQ(set_armed("instability.force", 0.2), Refusal::none);
  EXPECT_EQ(set_armed("instability.force", 0.3), Refusal::only_tightens);
  EXPECT_EQ(set_armed("instability.amplitude", 5e-5), Refusal::none);
  EXPECT_EQ(set_armed("instability.amplitude", 8e-5), Refusal::only_tightens);
}

TEST_F(WhileArmed, ACeilingThatWasSetBeforeLeavesRoom) {
  ASSERT_EQ(set("wall.stiffness_ceiling", 4000), Refusal::none);
  ASSERT_EQ(set("force.ceiling", 2), Refusal::none);
  EXPECT_EQ(set_armed("wall.stiffness", 4000), Refusal::none);
  EXPECT_EQ(set_armed("wall.stiffness", 10), Refusal::none);
  EXPECT_EQ(set_armed("wall.stiffness", 4000), Refusal::none);
  EXPECT_EQ(set_armed("wall.stiffness", 4001), Refusal::only_tightens);
  for (const double force : {2.0, -2.0, 0.5, -1.0})
    EXPECT_EQ(set_armed("interference.background_force", force), Refusal::none) << force;
  EXPECT_EQ(set_armed("interference.background_force", 2.01), Refusal::only_tightens);
  // Above its ceiling already: that one allows nothing more.
  EXPECT_EQ(set_armed("force.limit", 3.2), Refusal::none);
  EXPECT_EQ(set_armed("force.limit", 3.3), Refusal::only_tightens);
}

TEST_F(WhileArmed, AnAxisWithoutForceIsFreeAndTheDevicesBoundsAreOfAll) {
  EXPECT_EQ(set_armed("force.limit", 10, 1, only(0)), Refusal::none);
  EXPECT_EQ(set_armed("force.limit", 10, 0, only(1)), Refusal::none);
  EXPECT_EQ(set_armed("force.limit", 20, 1, only(1)), Refusal::only_tightens);
  EXPECT_EQ(set_armed("supply.voltage_max", 30, 0, only(1)), Refusal::only_tightens);
}

TEST_F(WhileArmed, ATransactionBeganDisarmedIsJudgedByWhatIsArmedWhenItIsApplied) {
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(set("force.limit", 10), Refusal::none);
  ASSERT_EQ(set("wall.stiffness", 500), Refusal::none);
  const auto before = registers.bits();
  EXPECT_EQ(registers.write(address_of("transaction.control"), Words{2}, only(0), now).refusal,
            Refusal::only_tightens);
  EXPECT_EQ(registers.last_refusal().address, address_of("force.limit"));
  EXPECT_EQ(registers.bits(), before);
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(set("force.limit", 10), Refusal::none);
  EXPECT_EQ(registers.write(address_of("transaction.control"), Words{2}, only(1), now).refusal,
            Refusal::none);
}

TEST_F(WhileArmed, AnotherLinkLoosensNothingUpToACeiling) {
  ASSERT_EQ(set("force.ceiling", 10), Refusal::none);
  ASSERT_EQ(set("force.limit", 3), Refusal::none);
  const ArmedAxes over_can = only(0, Link::can);
  EXPECT_EQ(set_armed("force.limit", 8, 0, over_can, Link::serial), Refusal::only_tightens);
  EXPECT_EQ(set_armed("force.limit", 8, 0, over_can, Link::can), Refusal::none) << "its commander";
  EXPECT_EQ(set_armed("force.limit", 2, 0, over_can, Link::serial), Refusal::none);
}

// A force that goes does not come back; the number of a commander is for the next arming.
TEST_F(WhileArmed, WhileAForceFadesItsCommanderChangesNothingButItsNumber) {
  ASSERT_EQ(set("force.ceiling", 10), Refusal::none);
  ArmedAxes fading = only(0, Link::can);
  fading.fades[0] = true;
  EXPECT_EQ(set_armed("wall.stiffness", 900, 0, fading, Link::can), Refusal::while_armed);
  EXPECT_EQ(set_armed("excitation.bias", 1, 0, fading, Link::can), Refusal::while_armed);
  EXPECT_EQ(set_armed("drive.commander", 5, 0, fading, Link::can), Refusal::none);
  EXPECT_EQ(set_armed("drive.commander", 6, 0, fading, Link::serial), Refusal::other_commander);
  EXPECT_EQ(set_armed("force.limit", 3, 0, fading, Link::can), Refusal::none) << "a bound is tightened";
  EXPECT_EQ(set_armed("force.limit", 5, 0, fading, Link::can), Refusal::only_tightens) << "no ceiling now";
  EXPECT_EQ(set_armed("wall.stiffness", 900, 1, fading, Link::can), Refusal::none) << "the other axis";
}

TEST_F(WhileArmed, AStoredSetIsNoWayRound) {
  ParameterValues looser = registers.values();
  looser.set_real<"force.limit">(10.0f, 0);
  EXPECT_EQ(registers.set_all(looser, only(0)).refusal, Refusal::only_tightens);
  EXPECT_EQ(get("force.limit"), static_cast<double>(3.3f));
}

TEST_F(WhileArmed, ABackgroundForceNeverTurnsRound) {
  for (const std::string_view name : {"interference.background_force", "interference.force"}) {
    ASSERT_EQ(set(name, 3), Refusal::none);
    EXPECT_EQ(set_armed(name, -3), Refusal::only_tightens) << name;
    EXPECT_EQ(set_armed(name, -0.1), Refusal::only_tightens) << name;
    EXPECT_EQ(set_armed(name, 1), Refusal::none) << name;
    EXPECT_EQ(set_armed(name, 0), Refusal::none) << name;
    EXPECT_EQ(set_armed(name, -0.1), Refusal::only_tightens) << name;
  }
}

// Written down here a second time, and not read from the dictionary: an entry whose rule is wrong or
// forgotten fails. What an entry's commander may change freely is what it asks of the axis, in the groups
// that nobody else may change, and the adaptive law's shape within its bounds.
TEST_F(WhileArmed, EveryEntryHasTheRuleThatItsDangerAsksFor) {
  const std::set<std::string_view> anytime_by_commander = {
      "wall.adaptive_gain",      "wall.adaptive_offset",   "wall.adaptive_velocity_max",
      "wall.adaptive_relation",  "wall.adaptive_velocity", "wall.adaptive_mode",
      "wall.adaptive_hold_time", "drive.commander",        "profile.target_torque",
      "profile.max_torque",      "profile.target_force"};
  const std::map<std::string_view, Change> directions = {
      {"wall.stiffness", Change::only_lower},
      {"wall.damping", Change::only_lower},
      {"wall.magnetic_coefficient", Change::only_lower},
      {"wall.adaptive_force_min", Change::only_lower},
      {"wall.adaptive_force_max", Change::only_lower},
      {"interference.force", Change::only_nearer_zero},
      {"interference.background_force", Change::only_nearer_zero},
      {"interference.onset_time", Change::only_higher},
      {"velocity.limit", Change::only_lower},
      {"force.limit", Change::only_lower},
      {"force.slew_limit", Change::only_lower},
      {"force.ramp_time", Change::only_higher},
      {"guard.damping", Change::only_lower},
      {"guard.friction", Change::only_lower},
      {"guard.delay", Change::only_higher},
      {"instability.action", Change::only_higher},
      {"instability.force", Change::only_lower},
      {"instability.amplitude", Change::only_lower},
      {"temperature.limit", Change::only_lower},
      {"temperature.derating", Change::only_higher},
      {"temperature.motor_limit", Change::only_lower},
      {"temperature.ambient", Change::only_higher},
      {"temperature.winding_resistance", Change::only_higher},
      {"temperature.case_resistance", Change::only_higher},
      {"excitation.travel", Change::only_lower},
      {"supply.voltage_min", Change::only_higher},
      {"supply.voltage_max", Change::only_lower}};
  // Of the device: what only reads, what asks for something that is refused while armed, and what takes
  // effect at the next start.
  const std::set<std::string_view> anytime_by_anybody = {
      "drive.controlword",   "link.sign_of_life", "node.id",    "can.bit_rate",
      "transaction.control", "store.command",     "log.command"};
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.access == Access::read_only) continue;
    const std::string_view group = e.name.substr(0, e.name.find('.'));
    Change expected = Change::disarmed_only;
    bool by_commander = false;
    if (const auto direction = directions.find(e.name); direction != directions.end()) {
      expected = direction->second;
    } else if (anytime_by_commander.contains(e.name) || group == "excitation" ||
               e.name.ends_with("_option")) {
      expected = Change::any_time;
      by_commander = true;
    } else if (anytime_by_anybody.contains(e.name) || group == "trace" || group == "capture" ||
               group.starts_with("tpdo") || (group == "canopen" && !e.name.starts_with("canopen.sync_"))) {
      expected = Change::any_time;
    }
    by_commander = by_commander || group == "wall" || group == "interference" || group == "excitation" ||
                   group == "profile" || (group == "drive" && e.name != "drive.controlword");
    EXPECT_EQ(e.change, expected) << e.name;
    EXPECT_EQ(e.group.of_commander, by_commander) << e.name;
  }
}

TEST_F(WhileArmed, WhatTheCommanderAsksForIsChangedByNobodyElse) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.access != Access::read_write || !e.group.of_commander || e.change == Change::disarmed_only)
      continue;
    const double lower = (e.default_value + e.minimum) / 2.0;
    const double other = !e.values.empty()                 ? static_cast<double>(e.values.back().value)
                         : e.change == Change::only_higher ? e.maximum
                         : e.default_value == e.minimum    ? e.maximum
                         : e.type == Type::float32         ? lower
                                                           : std::floor(lower);
    if (raw_from_number(e.type, other) == raw_from_number(e.type, e.default_value)) continue;
    EXPECT_EQ(set_armed(e.name, other, 0, only(0, Link::can), Link::serial), Refusal::other_commander)
        << e.name;
    EXPECT_EQ(registers.last_refusal().address, address_of(e.name)) << e.name;
    EXPECT_EQ(set_armed(e.name, e.default_value, 0, only(0, Link::can), Link::serial), Refusal::none)
        << e.name << ": nothing changes";
    EXPECT_NE(set_armed(e.name, other, 1, only(0, Link::can), Link::serial), Refusal::other_commander)
        << e.name << ": the other axis";
  }
  EXPECT_EQ(set_armed("force.limit", 1, 0, only(0, Link::can), Link::serial), Refusal::none)
      << "anybody may tighten what protects";
}

TEST_F(WhileArmed, ATransactionOfBeforeTheArmingChangesNothingOfAnother) {
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(set("wall.stiffness", 500), Refusal::none);
  EXPECT_EQ(registers.write(address_of("transaction.control"), Words{2}, only(0, Link::can), now).refusal,
            Refusal::other_commander);
  EXPECT_EQ(get("wall.stiffness"), 1000);
}

// Whatever is tried, in whatever order: no bound of an armed axis ever gets looser than it was at arming, or
// than its ceiling.
RC_GTEST_PROP(WhileArmedAlways, NoBoundGetsLooserThanItsCeilingOrThanAtArming, ()) {
  RegisterAccess registers;
  const auto random_of = [](const Entry& e) {
    const double share = static_cast<double>(*rc::gen::inRange(0, 1001)) / 1000.0;
    return *rc::gen::element(e.minimum, e.maximum, e.default_value, 0.0, e.default_value * 2.0 * share,
                             e.minimum + share * share * (e.maximum - e.minimum));
  };
  std::vector<std::size_t> bounds;
  std::set<std::string_view> ceilings;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.change == Change::any_time || e.change == Change::disarmed_only) continue;
    bounds.push_back(i);
    if (!e.ceiling.empty()) ceilings.insert(e.ceiling);
  }
  for (const std::string_view name : ceilings)
    registers.write(address_of(name), words_for(name, random_of(entry_at(entry_named(name)))), false, 0);
  const ParameterValues armed_with = registers.values();
  const int steps = *rc::gen::inRange(1, 80);
  for (int step = 0; step < steps; ++step) {
    const std::size_t entry = *rc::gen::elementOf(bounds);
    const Entry& e = entry_at(entry);
    registers.write(address_of(e.name), words_for(e.name, random_of(e)), only(0), 0);
  }
  for (const std::size_t entry : bounds) {
    const Entry& e = entry_at(entry);
    const auto number = [entry](const ParameterValues& values) {
      return static_cast<double>(std::bit_cast<float>(values.raw(slot_of(entry, 0))));
    };
    const double was = number(armed_with), is = number(registers.values());
    const double ceiling =
        e.ceiling.empty()
            ? 0.0
            : static_cast<double>(std::bit_cast<float>(armed_with.raw(slot_of(find_entry(e.ceiling), 0))));
    if (e.change == Change::only_higher) {
      RC_ASSERT(is >= was);
    } else if (e.unbounded_at_zero && was == 0.0) {
      continue;  // anything was allowed
    } else {
      RC_ASSERT(std::abs(is) <= std::max(std::abs(was), ceiling) ||
                (e.change == Change::only_lower && is <= was));
      if (e.unbounded_at_zero) RC_ASSERT(is != 0.0);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::armed_change_test
