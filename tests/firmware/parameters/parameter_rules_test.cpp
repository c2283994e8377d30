#include "firmware/parameters/parameter_rules.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::firmware::parameter_rules_test {
namespace {

constexpr std::size_t rate_entry = entry_of<"haptic.rate">();
constexpr std::size_t adaptive_min_entry = entry_of<"wall.adaptive_force_min">();
constexpr std::size_t supply_min_entry = entry_of<"supply.voltage_min">();

TEST(ParameterRules, EveryDividerOfTheTickRateIsARateOnEitherAxis) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    for (int divider = 1; divider <= 200; ++divider) {
      ParameterValues values;
      // As a host computes it: the nearest float of the quotient, whole or not.
      values.set_real<"haptic.rate">(static_cast<float>(20000.0 / divider), axis);
      EXPECT_EQ(check_rules(values).refusal, Refusal::none) << divider;
    }
  }
}

TEST(ParameterRules, RatesThatDoNotDivideAreRefusedAndNamed) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    for (const float rate : {19999.0f, 15000.0f, 10001.0f, 9999.0f, 300.0f, 501.0f, 100.5f, 13333.3f}) {
      ParameterValues values;
      values.set_real<"haptic.rate">(rate, axis);
      const BrokenRule broken = check_rules(values);
      EXPECT_EQ(broken.refusal, Refusal::rate_does_not_divide) << rate;
      EXPECT_EQ(broken.slot, slot_of(rate_entry, axis));
    }
  }
}

TEST(ParameterRules, ACompensationStaysBelowTheFriction) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    ParameterValues values;
    values.set_real<"guard.friction">(0.5f, axis);
    for (const float limit : {0.0f, 0.25f, std::nextafter(0.5f, 0.0f), 0.5f, 3.0f}) {
      values.set_real<"compensation.limit">(limit, axis);
      const BrokenRule broken = check_rules(values);
      EXPECT_EQ(broken.refusal, limit < 0.5f ? Refusal::none : Refusal::compensation_beyond_friction)
          << limit;
      EXPECT_EQ(broken.slot, limit < 0.5f ? 0 : slot_of(entry_of<"compensation.limit">(), axis));
    }
    values.set_real<"guard.friction">(0.0f, axis);
    values.set_real<"compensation.limit">(0.0f, axis);
    EXPECT_EQ(check_rules(values).refusal, Refusal::none) << "off";
  }
}

TEST(ParameterRules, IntervalsMayBeAPointButNotTurnedRound) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    ParameterValues values;
    values.set_real<"wall.adaptive_force_min">(2.0f, axis);
    EXPECT_EQ(check_rules(values).refusal, Refusal::none) << "min = max";
    values.set_real<"wall.adaptive_force_min">(std::nextafter(2.0f, 3.0f), axis);
    EXPECT_EQ(check_rules(values).refusal, Refusal::adaptive_interval_empty);
    EXPECT_EQ(check_rules(values).slot, slot_of(adaptive_min_entry, axis));
  }
  ParameterValues values;
  values.set_real<"supply.voltage_max">(26.0f);
  values.set_real<"supply.voltage_min">(26.0f);
  EXPECT_EQ(check_rules(values).refusal, Refusal::supply_interval_empty) << "no voltage would be allowed";
  EXPECT_EQ(check_rules(values).slot, slot_of(supply_min_entry, 0));
  values.set_real<"supply.voltage_min">(std::nextafter(26.0f, 0.0f));
  EXPECT_EQ(check_rules(values).refusal, Refusal::none);
}

TEST(ParameterRules, TheSupplysLimitIsAtMostWhatTheBoardsPartsBear) {
  ParameterValues values;
  values.set_real<"supply.voltage_max">(100.0f);
  EXPECT_EQ(check_rules(values).refusal, Refusal::none) << "nothing is known of the board";
  values.set_real<"supply.ceiling">(25.68f);
  EXPECT_EQ(check_rules(values).refusal, Refusal::supply_above_ceiling);
  EXPECT_EQ(check_rules(values).slot, slot_of(entry_of<"supply.voltage_max">(), 0));
  values.set_real<"supply.voltage_max">(std::nextafter(25.68f, 26.0f));
  EXPECT_EQ(check_rules(values).refusal, Refusal::supply_above_ceiling);
  values.set_real<"supply.voltage_max">(25.68f);
  EXPECT_EQ(check_rules(values).refusal, Refusal::none);
}

}  // namespace
}  // namespace kmax::firmware::parameter_rules_test
