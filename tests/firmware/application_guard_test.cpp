// The stability guard through the whole firmware, as a host on the serial line sees it.
#include <gtest/gtest.h>

#include <cmath>

#include "control/stability_case.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "tests/board/bench.hpp"
#include "tests/firmware/fake_flash.hpp"

namespace kmax::board::application_guard_test {
namespace {

using control::Criterion;
using Verdict = firmware::GuardFinding::Verdict;

/// Counts of 1 um, 20 kHz, current loop of 4000 rad/s: T/2 + Td = 307.5 us, and 1.23 N s/m allow 4000.
class GuardedArming : public testing::Test {
 protected:
  GuardedArming() {
    for (const std::size_t axis : {0U, 1U}) {
      bench.set_up_plain_wall(axis);
      bench.device.stand_at(1000, axis);
      bench.preset("current.bandwidth", 4000, axis);
      bench.preset("guard.damping", 1.23, axis);
      bench.preset("guard.friction", 1, axis);
      bench.preset("guard.mode", 2, axis);
      // Room for the guard to refuse in.
      bench.preset("wall.stiffness_ceiling", 1e6, axis);
      bench.preset("wall.damping_ceiling", 1000, axis);
      bench.preset("force.ceiling", 1000, axis);
    }
    bench.run_ticks(20);
  }
  Verdict verdict(std::size_t axis = 0) {
    return static_cast<Verdict>(static_cast<int>(bench.get("guard.verdict", axis)));
  }
  bool warns(std::size_t axis = 0) {
    return (static_cast<unsigned>(bench.get("drive.statusword", axis)) & firmware::statusword::warning) != 0;
  }
  Refusal last_refusal() { return static_cast<Refusal>(static_cast<int>(bench.get("refusal.reason"))); }
  /// Refused by the guard, on this parameter, and nothing has changed.
  void expect_refused(std::string_view name, double number, std::size_t axis = 0) {
    const double before = bench.get(name, axis);
    const auto changes = bench.application().parameter_changes();
    EXPECT_EQ(bench.set(name, number, axis), 3) << name << ": illegal data value";
    EXPECT_EQ(last_refusal(), Refusal::guard_refused) << name;
    EXPECT_EQ(bench.get("refusal.register"), firmware::address_of(name, axis)) << name;
    EXPECT_EQ(bench.get(name, axis), before) << name;
    EXPECT_EQ(bench.application().parameter_changes(), changes);
    EXPECT_EQ(verdict(axis), Verdict::pass) << "the readings are of what is in force";
  }

  Bench bench;
};

TEST_F(GuardedArming, AWallThatTheDeviceBearsIsArmed) {
  EXPECT_EQ(verdict(), Verdict::pass);
  EXPECT_EQ(bench.get("guard.failed"), 0);
  EXPECT_EQ(bench.get("guard.criterion"), static_cast<int>(Criterion::colgate));
  EXPECT_EQ(bench.get("guard.value"), 1000);
  EXPECT_NEAR(bench.get("guard.bound"), 4000, 0.01);
  EXPECT_TRUE(bench.arm());
  EXPECT_FALSE(warns());
}

TEST_F(GuardedArming, ATooStiffWallIsRefusedWithItsNumbersAndArmedOnceItIsMended) {
  ASSERT_EQ(bench.set("wall.stiffness", 5500), 0) << "while disarmed every allowed value is taken";
  EXPECT_EQ(verdict(), Verdict::fail) << "known before anybody tries";
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::guard_refused);
  EXPECT_EQ(bench.state(), DriveState::switched_on);
  EXPECT_EQ(bench.get("guard.failed"), 1);
  EXPECT_EQ(bench.get("guard.criterion"), static_cast<int>(Criterion::colgate));
  EXPECT_EQ(bench.get("guard.value"), 5500);
  EXPECT_NEAR(bench.get("guard.bound"), 4000, 0.01);
  EXPECT_FALSE(warns()) << "that it does not arm is no warning";
  bench.run_ms(5);
  EXPECT_EQ(bench.state(), DriveState::switched_on);
  ASSERT_EQ(bench.set("wall.stiffness", 3900), 0);
  bench.command(0x0F);
  bench.run_ticks(3);
  EXPECT_EQ(bench.state(), DriveState::switched_on) << "a word that is held is no new request";
  EXPECT_TRUE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::none);
}

TEST_F(GuardedArming, EveryWayOfMendingItArms) {
  const struct {
    std::string_view name;
    double number;
  } ways[] = {{"guard.damping", 1.8}, {"current.bandwidth", 8000}, {"wall.law", 0},  {"guard.mode", 0},
              {"guard.mode", 1},      {"drive.mode", 2},           {"drive.mode", 1}};
  for (const auto& [name, number] : ways) {
    Bench other;
    other.set_up_plain_wall();
    other.device.stand_at(1000);
    other.preset("current.bandwidth", 4000);
    other.preset("guard.damping", 1.23);
    other.preset("guard.friction", 1);
    other.preset("wall.stiffness", 5500);
    other.preset("guard.mode", 2);
    other.run_ticks(20);
    EXPECT_FALSE(other.arm());
    EXPECT_EQ(other.refusal(), Refusal::guard_refused);
    EXPECT_EQ(other.set(name, number), 0);
    EXPECT_TRUE(other.arm()) << name << " = " << number;
  }
}

TEST_F(GuardedArming, BothSidesOfTheBoundToTheLastBit) {
  const auto bound = static_cast<float>(bench.get("guard.bound"));
  bench.set("wall.stiffness", static_cast<double>(bound));
  EXPECT_FALSE(bench.arm());
  bench.set("wall.stiffness", static_cast<double>(std::nextafter(bound, 0.0f)));
  EXPECT_TRUE(bench.arm());
}

TEST_F(GuardedArming, OneAxisThatFailsDoesNotHinderTheOther) {
  bench.set("wall.stiffness", 5500, 1);
  EXPECT_TRUE(bench.arm(0));
  EXPECT_FALSE(bench.arm(1));
  EXPECT_EQ(bench.refusal(1), Refusal::guard_refused);
  EXPECT_EQ(bench.refusal(0), Refusal::none);
  EXPECT_EQ(verdict(0), Verdict::pass);
  EXPECT_EQ(verdict(1), Verdict::fail);
}

TEST_F(GuardedArming, ASetWrittenRightBeforeTheCommandIsTheOneThatIsJudged) {
  bench.command(0x06);
  bench.set("wall.stiffness", 5500);
  bench.command(0x0F);
  bench.run_ticks(5);
  EXPECT_EQ(bench.state(), DriveState::switched_on);
  EXPECT_EQ(bench.refusal(), Refusal::guard_refused);
}

TEST_F(GuardedArming, WarningArmsAndShowsItInTheStatusword) {
  bench.set("guard.mode", 1);
  EXPECT_FALSE(warns());
  bench.set("wall.stiffness", 5500);
  EXPECT_TRUE(warns()) << "before it is armed";
  EXPECT_FALSE(warns(1));
  ASSERT_TRUE(bench.arm());
  EXPECT_TRUE(warns());
  EXPECT_EQ(verdict(), Verdict::fail);
  // While it is armed too, whatever the change.
  EXPECT_EQ(bench.set("wall.stiffness", 1e6), 0);
  EXPECT_TRUE(warns());
  EXPECT_EQ(bench.get("guard.value"), 1e6);
  EXPECT_EQ(bench.set("wall.stiffness", 1000), 0);
  EXPECT_FALSE(warns());
}

TEST_F(GuardedArming, OffJudgesNothing) {
  bench.set("guard.mode", 0);
  bench.set("wall.stiffness", 1e6);
  EXPECT_EQ(verdict(), Verdict::not_judged);
  for (const char* name : {"guard.failed", "guard.criterion", "guard.value", "guard.bound"})
    EXPECT_EQ(bench.get(name), 0) << name;
  ASSERT_TRUE(bench.arm());
  EXPECT_FALSE(warns());
}

TEST_F(GuardedArming, WhileArmedNoSingleWriteMayBreakACriterion) {
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-1000);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), 1.0f);
  expect_refused("wall.stiffness", 4001);
  expect_refused("wall.damping", 1);
  expect_refused("guard.damping", 0.2);
  expect_refused("guard.friction", 1e-4);
  expect_refused("guard.delay", 0.002);
  bench.run_ms(2);
  EXPECT_EQ(bench.force(), 1.0f) << "the wall is as it was";
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  EXPECT_EQ(bench.set("wall.stiffness", 3999), 0);
  // Nor may the guard itself be taken away, or what it counts on be said to be more.
  EXPECT_NE(bench.set("guard.damping", 2.2), 0);
  EXPECT_EQ(last_refusal(), Refusal::only_tightens);
  EXPECT_NE(bench.set("guard.mode", 0), 0);
  EXPECT_EQ(last_refusal(), Refusal::while_armed);
  bench.disarm();
  EXPECT_EQ(bench.set("wall.stiffness", 1e6), 0);
}

TEST_F(GuardedArming, WhileArmedAFieldMayNotGrowBeyondItsBound) {
  for (const int law : {2, 3}) {
    bench.disarm();
    bench.set("wall.law", law);
    bench.set("wall.magnetic_coefficient", 1);
    bench.set("wall.adaptive_force_min", 0.8);
    bench.set("wall.adaptive_force_max", 1);
    bench.device.stand_at(100'000);
    bench.run_ms(5);
    ASSERT_TRUE(bench.arm()) << law;
    if (law == 2) expect_refused("wall.magnetic_coefficient", 2.1);
    if (law == 3) expect_refused("wall.adaptive_force_max", 2.1);
  }
}

TEST_F(GuardedArming, WhileArmedATransactionIsJudgedAsAWhole) {
  ASSERT_TRUE(bench.arm());
  const auto transaction = [&](int request) { return bench.set("transaction.control", request); };
  // The first by itself would be refused; together they pass.
  EXPECT_EQ(transaction(1), 0);
  EXPECT_EQ(bench.set("guard.damping", 0.305), 0);
  EXPECT_EQ(bench.set("wall.stiffness", 990), 0);
  EXPECT_EQ(transaction(2), 0);
  EXPECT_EQ(bench.get("wall.stiffness"), 990);
  // And here together they fail: nothing of it is taken.
  EXPECT_EQ(transaction(1), 0);
  EXPECT_EQ(bench.set("wall.damping", 1.5), 0);
  EXPECT_EQ(bench.set("force.limit", 2), 0);
  EXPECT_EQ(transaction(2), 3);
  EXPECT_EQ(last_refusal(), Refusal::guard_refused);
  EXPECT_EQ(bench.get("refusal.register"), firmware::address_of("wall.damping"));
  EXPECT_EQ(bench.get("wall.damping"), 0);
  EXPECT_NEAR(bench.get("force.limit"), 3.3, 1e-6);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  // Put aside while disarmed, committed while armed.
  bench.disarm();
  EXPECT_EQ(transaction(1), 0);
  EXPECT_EQ(bench.set("wall.stiffness", 50'000), 0);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(transaction(2), 3);
  EXPECT_EQ(bench.get("wall.stiffness"), 990);
}

TEST_F(GuardedArming, WhileArmedTheOtherAxisAndWhatIsNotJudgedChangeFreely) {
  ASSERT_TRUE(bench.arm(0));
  EXPECT_EQ(bench.set("wall.stiffness", 1e6, 1), 0);
  EXPECT_EQ(bench.set("force.limit", 1000), 0);
  EXPECT_EQ(bench.set("excitation.bias", 100), 0);
}

TEST_F(GuardedArming, InTheModesWithoutAWallNothingIsRefused) {
  bench.set("wall.stiffness", 1e6);
  bench.set("drive.mode", 2);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(verdict(), Verdict::not_judged);
  EXPECT_EQ(bench.set("wall.damping", 1000), 0);
  bench.disarm();
  bench.set("drive.mode", 0);
  EXPECT_EQ(verdict(), Verdict::fail);
  EXPECT_FALSE(bench.arm());
}

TEST_F(GuardedArming, TheBoardsOwnObstaclesAreToldFirst) {
  bench.set("wall.stiffness", 5500);
  bench.device.valid[0] = false;
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.refusal(), Refusal::encoder_invalid);
}

TEST_F(GuardedArming, DefaultsAndTheStoreBringTheGuardsSettingsAndItsVerdictAlong) {
  firmware::FakeFlash flash;
  {
    Bench first;
    first.application().attach_store(firmware::AnyFlashSectors::of(flash));
    first.set_up_plain_wall();
    first.set("guard.mode", 2);
    first.set("guard.delay", 0.0125);
    first.set("store.command", 1);
    first.run_ms(2000);
    ASSERT_EQ(first.get("store.unsaved_parameters"), 0);
  }
  Bench second;
  second.application().attach_store(firmware::AnyFlashSectors::of(flash));
  second.device.stand_at(1000);
  second.run_ms(5);
  EXPECT_EQ(second.get("guard.mode"), 2);
  EXPECT_NEAR(second.get("guard.delay"), 0.0125, 1e-9);
  EXPECT_EQ(static_cast<int>(second.get("guard.verdict")), static_cast<int>(Verdict::fail)) << "no damping";
  EXPECT_FALSE(second.arm());
  EXPECT_EQ(second.refusal(), Refusal::guard_refused);
  second.set("store.command", 2);
  EXPECT_EQ(second.get("guard.mode"), 0);
  EXPECT_EQ(second.get("guard.verdict"), 0);
}

}  // namespace
}  // namespace kmax::board::application_guard_test
