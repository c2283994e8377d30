#include "host_tools/check/change_search.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>

#include "firmware/parameters/parameter_rules.hpp"

namespace kmax::check::change_search_test {

using control::Criterion;
using device::Parameter;
using firmware::ParameterValues;

ParameterValues with(ParameterValues values, const Change& change, float value) {
  values.set_raw(firmware::slot_of(change.parameter.entry(), change.parameter.axis()),
                 std::bit_cast<std::uint32_t>(value));
  return values;
}

const Change* find(const std::vector<Change>& changes, const Parameter& parameter) {
  for (const Change& change : changes) {
    if (change.parameter == parameter) return &change;
  }
  return nullptr;
}

TEST(ChangeSearch, ColgateSolvedForEachOfItsNumbers) {
  ParameterValues values;
  values.set_real<"guard.damping">(0.5f);
  values.set_real<"wall.stiffness">(2000);
  const Judgement judgement = judge_parameters(values, 0, {});
  const auto& changes = judgement.verdicts[static_cast<std::size_t>(Criterion::colgate)].changes;
  const Change* stiffness = find(changes, Parameter::of<"wall.stiffness">());
  ASSERT_NE(stiffness, nullptr);
  EXPECT_EQ(stiffness->value, 1270.0f)
      << "0.5 / (25 us + 333.3 us + 32.5 us) = 1279.3, rounded to the safe side";
  EXPECT_FALSE(stiffness->at_least);
  EXPECT_FALSE(stiffness->fact);
  const Change* damping = find(changes, Parameter::of<"guard.damping">());
  ASSERT_NE(damping, nullptr);
  EXPECT_EQ(damping->value, 0.782f);
  EXPECT_TRUE(damping->at_least);
  EXPECT_TRUE(damping->fact);
  const Change* bandwidth = find(changes, Parameter::of<"current.bandwidth">());
  ASSERT_NE(bandwidth, nullptr);
  EXPECT_EQ(bandwidth->value, 5200.0f);
  EXPECT_EQ(find(changes, Parameter::of<"haptic.rate">()), nullptr) << "20 kHz is the fastest";
  EXPECT_EQ(find(changes, Parameter::of<"wall.damping">()), nullptr);
}

TEST(ChangeSearch, RatesAreThoseTheDeviceHas) {
  ParameterValues values;
  values.set_real<"guard.damping">(0.8f);
  values.set_real<"haptic.rate">(500);
  const auto changes = judge_parameters(values, 0, {}).verdicts[0].changes;
  const Change* rate = find(changes, Parameter::of<"haptic.rate">());
  ASSERT_NE(rate, nullptr);
  // T/2 + 365.8 us below 0.8 / 1000 s: above 1151.6 Hz, and 20000/17 = 1176.5 is the next that divides.
  EXPECT_EQ(rate->value, static_cast<float>(20000.0 / 17));
}

TEST(ChangeSearch, AZeroThatTheBoundAsksForIsFound) {
  ParameterValues values;
  values.set_real<"wall.damping">(1);
  const auto undamped = [](const ParameterValues& v) { return v.real<"wall.damping">() == 0.0f; };
  const auto changes = find_changes(values, 0, undamped);
  const Change* damping = find(changes, Parameter::of<"wall.damping">());
  ASSERT_NE(damping, nullptr);
  EXPECT_EQ(damping->value, 0.0f);
}

TEST(ChangeSearch, NothingHelpsWhereNothingCan) {
  EXPECT_TRUE(find_changes(ParameterValues{}, 0, [](const ParameterValues&) { return false; }).empty());
  // No wall at all is no answer.
  const auto no_wall = [](const ParameterValues& v) { return v.real<"wall.stiffness">() == 0.0f; };
  EXPECT_TRUE(find_changes(ParameterValues{}, 0, no_wall).empty());
}

TEST(ChangeSearch, SwitchingACriterionOffIsNoAnswer) {
  ParameterValues values;
  values.set_real<"guard.operator_force">(1e-6f);
  const auto changes = judge_parameters(values, 0, {}).verdicts[5].changes;
  EXPECT_FALSE(changes.empty());
  for (const Change& change : changes) {
    EXPECT_NE(change.value, 0.0f) << change.parameter.name();
  }
}

RC_GTEST_PROP(ChangeSearch, WhatIsProposedWorksAndLittleLessDoesNot, ()) {
  ParameterValues values;
  values.set_whole<"wall.law">(*rc::gen::inRange(1u, 4u));
  values.set_real<"wall.stiffness">(static_cast<float>(*rc::gen::inRange(100, 20000)));
  values.set_real<"haptic.rate">(*rc::gen::element(500.0f, 1000.0f, 2000.0f, 20000.0f));
  values.set_real<"guard.damping">(static_cast<float>(*rc::gen::inRange(0, 300)) * 0.01f);
  values.set_real<"guard.friction">(static_cast<float>(*rc::gen::inRange(0, 50)) * 0.01f);
  values.set_real<"guard.operator_force">(static_cast<float>(*rc::gen::inRange(0, 50)) * 0.02f);
  values.set_real<"guard.operator_speed">(static_cast<float>(*rc::gen::inRange(0, 50)) * 0.02f);
  for (const Criterion criterion :
       {Criterion::colgate, Criterion::gil, Criterion::abbott_okamura, Criterion::diolaiti,
        Criterion::resolution, Criterion::field_slope, Criterion::saturation_depth}) {
    const auto met = [criterion](const ParameterValues& v) {
      const auto result = control::judge(criterion, parameter_case(v, 0));
      return result.applies && result.pass;
    };
    if (!control::judge(criterion, parameter_case(values, 0)).applies || met(values)) continue;
    for (const Change& change : find_changes(values, 0, met)) {
      const ParameterValues changed = with(values, change, change.value);
      RC_ASSERT(met(changed));
      RC_ASSERT(firmware::check_rules(changed).refusal == firmware::Refusal::none);
      if (change.parameter == Parameter::of<"haptic.rate">() || change.value == 0.0f) continue;
      // A quantum moves in whole counts.
      if (change.parameter == Parameter::of<"position.resolution">()) continue;
      RC_ASSERT(!met(with(values, change, change.value * (change.at_least ? 0.98f : 1.02f))));
    }
  }
}

}  // namespace kmax::check::change_search_test
