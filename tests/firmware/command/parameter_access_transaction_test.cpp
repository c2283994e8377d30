// The transactions of ParameterAccess; single writes are in parameter_access_test.cpp.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::parameter_access_transaction_test {
namespace {

using Transaction = NamedParameters;

TEST_F(Transaction, NothingShowsBeforeTheCommitAndAllOfItAfter) {
  EXPECT_EQ(control(1), Refusal::none);
  const auto before = registers.bits();
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(set("wall.position", 0.25), Refusal::none);
  EXPECT_EQ(registers.bits(), before);
  EXPECT_EQ(registers.changes(), 0u);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(get("wall.position"), 0.25);
  EXPECT_EQ(registers.changes(), 1u);
  EXPECT_EQ(registers.restarting_changes(), 1u);
  EXPECT_FALSE(registers.transaction_open());
  EXPECT_EQ(control(2), Refusal::no_transaction);
}

TEST_F(Transaction, AnOrderThatBreaksARuleHalfWayIsFineInside) {
  EXPECT_EQ(set("wall.adaptive_force_min", 5), Refusal::adaptive_interval_empty);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.adaptive_force_min", 5), Refusal::none);
  EXPECT_EQ(set("wall.adaptive_force_max", 6), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("wall.adaptive_force_min"), 5);
}

TEST_F(Transaction, ASetThatBreaksARuleIsDroppedWhole) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(set("haptic.rate", 300), Refusal::none);
  const auto before = registers.bits();
  EXPECT_EQ(control(2), Refusal::rate_does_not_divide);
  EXPECT_EQ(registers.last_refusal().address, address_of("haptic.rate"));
  EXPECT_EQ(registers.bits(), before);
  EXPECT_FALSE(registers.transaction_open());
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(registers.bits(), before) << "nothing of the dropped set comes back";
}

TEST_F(Transaction, ARefusedValueLeavesWhatWasStagedAndTheTransaction) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 2e6), Refusal::out_of_range);
  EXPECT_EQ(registers.write(address_of("wall.stiffness"), Words{0x7FC0, 0, 0, 0}, false, now).refusal,
            Refusal::not_finite);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 5000);
}

TEST_F(Transaction, EndsWithoutEffectWhenDroppedAndASecondBeginIsRefused) {
  const auto before = registers.bits();
  EXPECT_EQ(control(0), Refusal::none) << "nothing to drop is no error";
  EXPECT_EQ(control(2), Refusal::no_transaction);
  EXPECT_EQ(control(3), Refusal::out_of_range);
  EXPECT_EQ(control(0xFFFF), Refusal::out_of_range);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(control(1), Refusal::transaction_open);
  EXPECT_TRUE(registers.transaction_open());
  EXPECT_EQ(control(0), Refusal::none);
  EXPECT_EQ(control(2), Refusal::no_transaction);
  EXPECT_EQ(registers.bits(), before);
}

TEST_F(Transaction, TwoSecondsWithoutAWriteDropItAlsoAcrossTheClocksWrap) {
  for (const std::uint32_t start : {0u, 1000u, 0xFFFFFFFFu - 1'000'000u, 0xFFFFFFFFu, 0x7FFFFFFFu}) {
    registers = {};
    now = start;
    ASSERT_EQ(control(1), Refusal::none);
    now += 2'000'000;
    registers.poll(now);
    EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
    EXPECT_TRUE(registers.transaction_open()) << "exactly 2 s: still there";
    now += 2'000'000;
    registers.poll(now);
    EXPECT_TRUE(registers.transaction_open()) << "a write keeps it alive";
    EXPECT_EQ(set("wall.stiffness", 1e9), Refusal::out_of_range);  // refused: does not keep it alive
    now += 1;
    EXPECT_EQ(control(2), Refusal::no_transaction) << start;
    EXPECT_EQ(get("wall.stiffness"), 1000);
    // The poll alone drops it too.
    ASSERT_EQ(control(1), Refusal::none);
    now += 2'000'001;
    registers.poll(now);
    EXPECT_FALSE(registers.transaction_open());
    EXPECT_EQ(set("wall.damping", 1), Refusal::no_transaction) << "a message of that host that was held up";
    EXPECT_EQ(get("wall.damping"), 0);
    now += 30'000'001;
    EXPECT_EQ(set("wall.damping", 1), Refusal::none);
    EXPECT_EQ(get("wall.damping"), 1) << "half a minute later a write takes effect at once";
    ASSERT_EQ(control(1), Refusal::none);
    now += 2'000'001;
    registers.poll(now);
    ASSERT_EQ(control(0), Refusal::none);
    EXPECT_EQ(set("wall.damping", 2), Refusal::none) << "whoever writes transaction.control knows of it";
  }
}

TEST_F(Transaction, ArmedBetweenStagingAndCommitIsRefusedWhole) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(set("wall.position", 0.25), Refusal::none);
  const auto before = registers.bits();
  EXPECT_EQ(control(2, true), Refusal::while_armed);
  EXPECT_EQ(registers.last_refusal().address, address_of("wall.position"));
  EXPECT_EQ(registers.bits(), before);
  EXPECT_EQ(control(2, false), Refusal::no_transaction) << "dropped, not kept for later";
}

TEST_F(Transaction, WhileArmedTakesWhatMayChangeAndRefusesTheRestWhenStaged) {
  EXPECT_EQ(control(1, true), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 500, true), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000, true), Refusal::only_tightens);
  EXPECT_EQ(set("wall.position", 0.25, true), Refusal::while_armed);
  EXPECT_EQ(control(2, true), Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 500);
  EXPECT_EQ(get("wall.position"), 0);
}

TEST_F(Transaction, ControlwordsActAtOnceAndAreNotUndoneByTheCommit) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(registers.write(address_of("drive.controlword"), Words{0x0F}, false, now).refusal, Refusal::none);
  const auto controlword = registers.fetch_controlword(0);
  ASSERT_TRUE(controlword);
  EXPECT_EQ(controlword->word, 0x0F);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("drive.controlword"), 0x0F);
  EXPECT_FALSE(registers.fetch_controlword(0));
}

TEST_F(Transaction, AnEmptyOneChangesNothing) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(registers.changes(), 0u);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.position", 0.5), Refusal::none);
  EXPECT_EQ(set("wall.position", 0), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(registers.restarting_changes(), 0u) << "back to the old value is no change";
}

TEST_F(Transaction, ReadingsThatChangeMeanwhileAreNotWrittenBack) {
  EXPECT_EQ(control(1), Refusal::none);
  registers.values().set_real<"measured.force">(1.5f);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  registers.values().set_real<"measured.force">(2.5f);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(registers.values().real<"measured.force">(), 2.5f);
}

TEST_F(Transaction, AWholeSetMustWaitForItsEnd) {
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  ParameterValues wanted;
  wanted.set_real<"wall.damping">(3.0f);
  EXPECT_EQ(registers.set_all(wanted, false).refusal, Refusal::transaction_open);
  EXPECT_EQ(get("wall.damping"), 0);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(registers.set_all(wanted, false).refusal, Refusal::none);
  EXPECT_EQ(get("wall.damping"), 3);
  EXPECT_EQ(get("wall.stiffness"), 1000);
}

// What the device itself takes back meanwhile, for one: a rotor's angle that is lost must not be known again.
TEST_F(Transaction, ChangesOnlyWhatWasWrittenInIt) {
  EXPECT_EQ(set("motor.commutation_known", 1), Refusal::none);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(set("wall.stiffness", 5000), Refusal::none);
  EXPECT_EQ(set("wall.damping", 1), Refusal::none);
  registers.values().set_whole<"motor.commutation_known">(0);
  registers.values().set_real<"wall.damping">(2.0f);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("motor.commutation_known"), 0);
  EXPECT_EQ(get("wall.stiffness"), 5000);
  EXPECT_EQ(get("wall.damping"), 1) << "what was written wins";
  // Nothing of it is left for the next one.
  registers.values().set_real<"wall.stiffness">(3000.0f);
  EXPECT_EQ(control(1), Refusal::none);
  EXPECT_EQ(control(2), Refusal::none);
  EXPECT_EQ(get("wall.stiffness"), 3000);
}

// What was put aside and dropped before says nothing of what is refused now.
TEST_F(Transaction, TheStabilityChecksRefusalNamesWhatWasWritten) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const auto write_to = [&](std::string_view name, double number, bool armed = false) {
      return set(name, number, armed, axis);
    };
    for (const auto& [name, number] : {std::pair{"guard.mode", 2.0},
                                       {"wall.law", 1.0},
                                       {"wall.stiffness", 1000.0},
                                       {"wall.stiffness_ceiling", 1e6},
                                       {"wall.damping_ceiling", 1000.0},
                                       {"haptic.rate", 2000.0},
                                       {"current.bandwidth", 4000.0},
                                       {"encoder.counts_per_turn", 1e6},
                                       {"device.transmission", 1.5915494309189535},
                                       {"guard.damping", 5.325},
                                       {"guard.friction", 1.0}})
      ASSERT_EQ(write_to(name, number), Refusal::none) << name;
    EXPECT_EQ(control(1), Refusal::none);
    for (const std::string_view name : {"wall.damping", "guard.damping", "guard.friction", "guard.delay"})
      ASSERT_EQ(write_to(name, 0.5), Refusal::none) << name;
    EXPECT_EQ(control(0), Refusal::none);
    const auto before = registers.bits();
    EXPECT_EQ(write_to("wall.stiffness", 5e5, true), Refusal::guard_refused);
    EXPECT_EQ(registers.last_refusal().address, address_of("wall.stiffness", axis));
    EXPECT_EQ(write_to("wall.damping", 500, true), Refusal::guard_refused);
    EXPECT_EQ(registers.last_refusal().address, address_of("wall.damping", axis));
    EXPECT_EQ(registers.bits(), before);
    EXPECT_EQ(write_to("wall.stiffness", 900, true), Refusal::none);
  }
}

}  // namespace
}  // namespace kmax::firmware::parameter_access_transaction_test
