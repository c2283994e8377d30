#include "host_tools/check/judgement.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "firmware/drive/stability_case.hpp"
#include "firmware/parameters/parameter_rules.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::judgement_test {

using control::Criterion;
using control::CriterionResult;
using firmware::ParameterValues;
constexpr double largest = std::numeric_limits<double>::max();

CriterionResult<double> at_most(double value, double bound) {
  return {Criterion::colgate, true, value < bound, false, value, bound};
}
CriterionResult<double> at_least(double value, double bound) {
  return {Criterion::saturation_depth, true, value >= bound, true, value, bound};
}
const Verdict& verdict_of(const Judgement& judgement, Criterion criterion) {
  return judgement.verdicts[static_cast<std::size_t>(criterion)];
}

/// Meets everything that can be judged.
ParameterValues good() {
  ParameterValues values;
  values.set_real<"guard.damping">(5);
  values.set_real<"guard.friction">(1);
  return values;
}

TEST(Judgement, TheMarginIsAPartOfTheBound) {
  EXPECT_DOUBLE_EQ(*margin_of(at_most(750, 1000)), 0.25);
  EXPECT_DOUBLE_EQ(*margin_of(at_most(1500, 1000)), -0.5);
  EXPECT_DOUBLE_EQ(*margin_of(at_most(0, 1000)), 1);
  EXPECT_DOUBLE_EQ(*margin_of(at_most(1000, 1000)), 0);
  EXPECT_DOUBLE_EQ(*margin_of(at_least(3, 2)), 0.5);
  EXPECT_DOUBLE_EQ(*margin_of(at_least(1, 2)), -0.5);
}

TEST(Judgement, AMarginIsFiniteOrThereIsNone) {
  EXPECT_EQ(margin_of(at_most(1000, 0)), -1e6) << "no damping at all";
  EXPECT_EQ(margin_of(at_most(1000, -300)), -1e6) << "|B| above b";
  EXPECT_EQ(margin_of(at_most(1000, 1e-9)), -1e6);
  EXPECT_EQ(margin_of(at_most(0, 0)), 0);
  EXPECT_EQ(margin_of(at_most(1, largest)), std::nullopt);
  EXPECT_EQ(margin_of(at_least(largest, 1)), std::nullopt);
  EXPECT_EQ(margin_of(at_least(1, 0)), 1e6);
  EXPECT_EQ(margin_of({Criterion::gil, false, true, false, 3, 4}), std::nullopt);
}

RC_GTEST_PROP(Judgement, TheSignOfTheMarginIsTheVerdict, ()) {
  const double value = *rc::gen::inRange(0, 1000) * 1e-2, bound = *rc::gen::inRange(-100, 1000) * 1e-2;
  const auto margin = margin_of(at_most(value, bound));
  RC_ASSERT((margin.has_value() && std::isfinite(*margin)));
  if (value != bound) RC_ASSERT((*margin > 0) == (value < bound));
}

TEST(Judgement, PassTakesEveryCriterionThatApplies) {
  const Judgement judgement = judge_parameters(good(), 0, {});
  EXPECT_TRUE(judgement.pass);
  EXPECT_TRUE(judgement.changes.empty());
  EXPECT_FALSE(verdict_of(judgement, Criterion::resolution).result.applies);
  EXPECT_TRUE(verdict_of(judgement, Criterion::sampled_eigenvalues).result.applies);
  for (const Verdict& verdict : judgement.verdicts) EXPECT_TRUE(verdict.changes.empty());

  ParameterValues heuristic_fails = good();
  heuristic_fails.set_real<"guard.operator_force">(0.01f);
  const Judgement other = judge_parameters(heuristic_fails, 0, {});
  EXPECT_FALSE(other.pass);
  EXPECT_TRUE(other.pass_of(Worth::guarantee));
  EXPECT_TRUE(other.pass_of(Worth::necessary));
  EXPECT_FALSE(other.pass_of(Worth::heuristic));
}

TEST(Judgement, ColgateByHand) {
  ParameterValues values = good();
  values.set_real<"haptic.rate">(1000);
  values.set_real<"current.bandwidth">(2000);
  values.set_real<"guard.delay">(0.001f);
  values.set_real<"wall.damping">(1);
  const Verdict colgate = verdict_of(judge_parameters(values, 0, {}), Criterion::colgate);
  EXPECT_NEAR(colgate.result.bound, (5 - 1) / (0.0005 + 0.0015325), 1e-4);
  EXPECT_NEAR(*colgate.margin, 1 - 2.0325 / 4, 1e-6);
}

TEST(Judgement, AHandMovesTheEigenvalueBoundOnly) {
  ParameterValues values = good();
  values.set_real<"guard.damping">(0.5f);
  values.set_real<"haptic.rate">(1000);
  const Judgement free = judge_parameters(values, 0, {}),
                  held = judge_parameters(values, 0, {0.234, 540, 1.7, 147, 9.1});
  for (std::size_t i = 0; i < control::criterion_count; ++i) {
    const bool differs = free.verdicts[i].result.bound != held.verdicts[i].result.bound;
    EXPECT_EQ(differs, static_cast<Criterion>(i) == Criterion::sampled_eigenvalues) << i;
  }
}

TEST(Judgement, RegionsOfDiolaiti) {
  ParameterValues values = good();
  const auto region = [&values] { return to_string(region_of(parameter_case(values, 0))); };
  EXPECT_EQ(region(), "passive");
  values.set_real<"guard.friction">(0);
  EXPECT_EQ(region(), "limit cycle");
  values.set_real<"guard.damping">(0);
  EXPECT_EQ(region(), "unstable");
  values.set_real<"guard.friction">(1);
  EXPECT_EQ(region(), "locally stable");
}

TEST(Judgement, TheRegionCountsTheDelay) {
  ParameterValues values = good();
  values.set_real<"guard.damping">(1);
  EXPECT_EQ(region_of(parameter_case(values, 0)), control::DiolaitiRegion::passive);
  values.set_real<"guard.delay">(0.001f);
  const auto c = parameter_case(values, 0);
  EXPECT_EQ(region_of(c), control::DiolaitiRegion::locally_stable);
  EXPECT_NEAR(escape_speed_of(c), 1 / (1000 * (25e-6 + c.delay) - 1), 1e-6);
}

// No damper but one by difference or low_pass is what Colgate's condition and the step of the force are of.
TEST(Judgement, ADamperOfAnotherEstimatorIsNotGuaranteed) {
  ParameterValues values = good();
  values.set_real<"wall.damping">(0.5f);
  for (std::uint32_t estimator = 0; estimator < 6; ++estimator) {
    values.set_whole<"velocity.estimator">(estimator);
    const Judgement judgement = judge_parameters(values, 0, {});
    EXPECT_TRUE(judgement.pass) << estimator;
    EXPECT_EQ(judgement.guaranteed(), estimator < 2) << estimator;
    EXPECT_EQ(judgement.uncovered_damper, estimator >= 2) << estimator;
  }
  values.set_real<"wall.damping">(0);
  EXPECT_TRUE(judge_parameters(values, 0, {}).guaranteed());
}

TEST(Judgement, WithoutAForceThereIsNothingToGuarantee) {
  ParameterValues values = good();
  values.set_real<"wall.stiffness">(0);
  EXPECT_FALSE(judge_parameters(values, 0, {}).guaranteed());
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  EXPECT_TRUE(judge_parameters(values, 0, {}).guaranteed()) << "a field alone";
}

TEST(Judgement, TheAdaptiveLawIsSaidNotToBeJudgedWhole) {
  ParameterValues values = good();
  EXPECT_FALSE(judge_parameters(values, 0, {}).follows_velocity);
  EXPECT_TRUE(judge_parameters(values, 0, {}).guaranteed());
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  EXPECT_TRUE(judge_parameters(values, 0, {}).follows_velocity);
  EXPECT_FALSE(judge_parameters(values, 0, {}).guaranteed());
}

template <typename Scalar>
std::array<double, 13> numbers_of(const control::StabilityCase<Scalar>& c) {
  const auto number = [](Scalar value) { return static_cast<double>(value); };
  return {number(c.stiffness),       number(c.wall_damping),   number(c.magnetic_coefficient),
          number(c.magnetic_length), number(c.period),         number(c.delay),
          number(c.quantum),         number(c.mass),           number(c.damping),
          number(c.friction),        number(c.operator_force), number(c.operator_speed),
          number(c.force_limit)};
}

TEST(ParameterCase, ANumberIsTheOneThatTheUserWroteAndTheHandIsTheCallers) {
  ParameterValues values;
  values.set_real<"haptic.rate">(500);
  values.set_real<"wall.magnetic_length">(0.002f);
  values.set_real<"device.mass">(0.06f);
  const auto c = parameter_case(values, 0, {0.2, 500, 2, 100, 9});
  EXPECT_EQ(c.period, 0.002);
  EXPECT_EQ(c.magnetic_length, 0.002);
  EXPECT_EQ(c.mass, 0.06);
  EXPECT_EQ(c.hand.hand_mass, 0.2);
  EXPECT_EQ(c.hand.arm_damping, 9);
}

// What is listed is what is read: any other parameter of the axis may take any value without a change.
TEST(ParameterCase, TheListedParametersAreThoseThatCount) {
  for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
    const auto listed = parameters_of_case(axis);
    for (const device::Parameter& parameter : device::all_parameters()) {
      if (!parameter.writable()) continue;
      bool changes = false;
      for (const auto& law : firmware::names::wall_law) {
        ParameterValues values;
        values.set_whole<"wall.law">(law.value, axis);
        values.set_real<"position.resolution">(0.001f, axis);
        // Wide enough for gain and offset to show.
        for (const float widest : {2.0f, 50.0f}) {
          values.set_real<"wall.adaptive_force_max">(widest, axis);
          for (const float offset : {0.0f, 0.8f}) {
            values.set_real<"wall.adaptive_offset">(offset, axis);
            values.set_real<"wall.adaptive_gain">(offset * 3, axis);
            ParameterValues changed = values;
            const std::size_t slot = firmware::slot_of(parameter.entry(), parameter.axis());
            const auto& entry = parameter.definition();
            const double middle = entry.values.empty() ? 0.5 * entry.minimum + 0.5 * entry.maximum : 0;
            changed.set_raw(
                slot, firmware::raw_from_number(
                          entry.type, entry.type == firmware::Type::float32 ? middle : std::trunc(middle)));
            const auto a = parameter_case(values, axis), b = parameter_case(changed, axis);
            changes = changes || numbers_of(a) != numbers_of(b);
          }
        }
      }
      const bool is_listed = std::find(listed.begin(), listed.end(), parameter) != listed.end();
      EXPECT_EQ(changes, is_listed) << parameter.name() << " for axis " << axis;
    }
  }
}

/// What a judgement says beside its numbers, as the parameters change.
TEST(ParametersOfJudgement, AreAllThatItsWordsDependOn) {
  const auto words_of_judgement = [](const ParameterValues& values) {
    const Judgement judgement = judge_parameters(values, 1, {});
    return std::array{judgement.follows_velocity, judgement.uncovered_damper, judgement.grows};
  };
  const auto listed = parameters_of_judgement(1);
  for (const device::Parameter& parameter : parameters_of_case(1))
    EXPECT_EQ(std::count(listed.begin(), listed.end(), parameter), 1) << parameter.name();
  std::size_t found = 0;
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (!parameter.writable()) continue;
    const firmware::Entry& entry = parameter.definition();
    bool changes = false;
    for (const std::int32_t window : {0, 1, 16}) {
      ParameterValues values;
      values.set_real<"wall.damping">(2.0F, 1);
      values.set_whole<"wall.damping_window">(window, 1);
      for (const double number : {entry.minimum, 0.25 * entry.maximum, entry.maximum, 1.0, 2.0, 500.0}) {
        if (number < entry.minimum || number > entry.maximum) continue;
        ParameterValues changed = values;
        changed.set_raw(parameter.slot(), firmware::raw_from_number(entry.type, std::trunc(number)));
        changes = changes || words_of_judgement(values) != words_of_judgement(changed);
      }
    }
    found += changes ? 1 : 0;
    if (changes) {
      EXPECT_NE(std::find(listed.begin(), listed.end(), parameter), listed.end()) << parameter.name();
    }
  }
  EXPECT_GE(found, 5U) << "law, damping and its window, estimator, growth";
}

// The device's own check before arming must not be of another case than the one that is explained here.
RC_GTEST_PROP(ParameterCase, TheFirmwaresGuardJudgesTheSameCase, ()) {
  ParameterValues values;
  const std::size_t axis = *rc::gen::inRange<std::size_t>(0, 2);
  for (const device::Parameter& parameter : parameters_of_case(axis)) {
    const firmware::Entry& entry = parameter.definition();
    const std::size_t slot = firmware::slot_of(parameter.entry(), parameter.axis());
    if (entry.type == firmware::Type::float32 && *rc::gen::arbitrary<bool>()) {
      const double share = *rc::gen::inRange(0, 1001) * 1e-3;
      values.set_raw(slot,
                     firmware::raw_from_number(
                         entry.type, entry.minimum + std::pow(share, 8) * (entry.maximum - entry.minimum)));
    }
  }
  values.set_whole<"wall.law">((*rc::gen::elementOf(std::to_array(firmware::names::wall_law))).value, axis);
  const auto here = parameter_case(values, axis);
  const auto there = firmware::stability_case(values, axis);
  const auto ours = numbers_of(here), guards = numbers_of(there);
  for (std::size_t i = 0; i < ours.size(); ++i)
    RC_ASSERT(std::abs(ours[i] - guards[i]) <= 1e-6 * std::max(std::abs(ours[i]), 1e-9));
  RC_ASSERT(here.detection_share == static_cast<double>(there.detection_share));
}

using device::Parameter;

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

std::string text_for(const ParameterValues& values, const control::Hand<double>& hand = {}) {
  return judgement_text(judge_parameters(values, 0, hand), "somebody");
}

ParameterValues with_damping(float damping, float friction) {
  ParameterValues values;
  values.set_real<"guard.damping">(damping);
  values.set_real<"guard.friction">(friction);
  return values;
}

TEST(CheckTable, EveryCriterionHasARowAndEveryWorthItsMeaning) {
  const std::string text = text_for(ParameterValues{});
  for (const CriterionText& criterion : all_criteria()) EXPECT_CONTAINS(text, criterion.name());
  for (const Worth worth : {Worth::guarantee, Worth::necessary, Worth::heuristic})
    EXPECT_CONTAINS(text, meaning_of(worth));
  EXPECT_CONTAINS(text, "needs guard.operator_force");
  EXPECT_CONTAINS(text, "hand    somebody");
}

/// Wherever its lines are broken.
std::string words_for(const ParameterValues& values, const control::Hand<double>& hand = {}) {
  std::string words = text_for(values, hand);
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

TEST(CheckTable, TheLastWordsSayWhatFollows) {
  EXPECT_CONTAINS(words_for(with_damping(5, 1)),
                  "pass: every criterion that applies is met. Stable with every");
  EXPECT_CONTAINS(words_for(ParameterValues{}), "unstable with nobody at the handle");
  EXPECT_CONTAINS(words_for(ParameterValues{}), "guard.damping is 0");
  ParameterValues stiff = with_damping(0.5f, 0.1f);
  stiff.set_real<"wall.stiffness">(4000);
  const control::Hand<double> hand{0.234, 540, 1.7, 147, 9.1};
  EXPECT_CONTAINS(words_for(stiff, hand), "Nothing is guaranteed, and the linear loop is stable");
  EXPECT_CONTAINS(words_for(stiff, hand), "Let go inside the wall");
  stiff.set_real<"wall.stiffness">(50000);
  EXPECT_CONTAINS(words_for(stiff, hand), "unstable with this hand");
  ParameterValues none;
  none.set_whole<"wall.law">(0);
  EXPECT_CONTAINS(words_for(none), "There is no wall");
  ParameterValues late = with_damping(5, 1);
  late.set_real<"guard.delay">(0.01f);
  EXPECT_CONTAINS(words_for(late), "could not be judged: T_d is 207 periods");
  EXPECT_CONTAINS(words_for(late), "sampled_eigenvalues  not judged: T_d is 207 periods, more than 8");
  ParameterValues adaptive = with_damping(5, 1);
  adaptive.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  EXPECT_CONTAINS(words_for(adaptive), "adaptive law's field follows the velocity");
}

// Its source has no delay, and every device has one. Its step is asked for all the same.
TEST(CheckTable, AbbottAndOkamuraGuaranteeNothingByThemselves) {
  const std::string text = text_for(with_damping(5, 1));
  EXPECT_GT(text.find("abbott_okamura"), text.find("\nheuristic (")) << text;
  EXPECT_LT(text.find("colgate"), text.find("\nnecessary (")) << text;
  // Enough damping, and friction that does not hold one step of the force.
  const Judgement rough = judge_parameters(with_damping(50, 1e-4f), 0, {});
  EXPECT_TRUE(rough.pass_of(Worth::guarantee));
  EXPECT_FALSE(rough.guarantees_met());
  EXPECT_FALSE(rough.guaranteed());
  EXPECT_CONTAINS(text_for(with_damping(50, 1e-4f)), "Nothing is guaranteed");
}

TEST(CheckTable, AFieldOrADamperAloneIsAWallToo) {
  ParameterValues field = with_damping(5, 1);
  field.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  field.set_real<"wall.stiffness">(0);
  field.set_real<"wall.magnetic_coefficient">(0.5f);
  const std::string text = text_for(field);
  EXPECT_EQ(text.find("There is no wall"), std::string::npos) << text;
  EXPECT_CONTAINS(text, "leaves out the field");
  EXPECT_CONTAINS(text, "Stable with every passive hand");
  EXPECT_CONTAINS(text, "colgate              not judged: wall.stiffness and wall.damping are 0");
  EXPECT_CONTAINS(text, "sampled_eigenvalues  not judged: wall.stiffness and wall.damping are 0");
  field.set_real<"guard.damping">(0);
  EXPECT_CONTAINS(text_for(field), "Nothing is guaranteed: if you try it");
  ParameterValues damper = with_damping(5, 1);
  damper.set_real<"wall.stiffness">(0);
  damper.set_real<"wall.damping">(0.1f);
  damper.set_whole<"velocity.estimator">(0);
  EXPECT_CONTAINS(text_for(damper), "Stable with every passive hand");
  EXPECT_CONTAINS(text_for(damper), "saturation_depth     not judged: wall.stiffness is 0");
  damper.set_real<"wall.damping">(0);
  EXPECT_CONTAINS(text_for(damper), "There is no wall");
}

// Stable again beyond the first loss: see control/sampled_stability.hpp.
TEST(CheckTable, AStableIslandIsNotCalledUnstable) {
  ParameterValues values = with_damping(0.08f, 0.1f);
  values.set_real<"device.mass">(0.05f);
  values.set_real<"guard.delay">(0.0015f);
  values.set_real<"haptic.rate">(2500);
  const control::Hand<double> hand{0.05, 2250, 9.6, 370, 1.1};
  const auto text_at = [&](float stiffness) {
    values.set_real<"wall.stiffness">(stiffness);
    return text_for(values, hand);
  };
  for (const float unstable : {700.0f, 4000.0f, 8000.0f})
    EXPECT_CONTAINS(text_at(unstable), "unstable with this hand: expect");
  const std::string text = text_at(5500);  // 4740 .. 6649 N/m
  EXPECT_CONTAINS(text, "The stiffness is beyond the first loss of stability");
  EXPECT_EQ(text.find("is unstable with"), std::string::npos) << text;
  EXPECT_CONTAINS(text, "no pass");
}

TEST(CheckTable, RemediesNameParameterSideAndUnit) {
  ParameterValues values = with_damping(0.5f, 0.1f);
  values.set_real<"wall.stiffness">(2000);
  const std::string text = text_for(values);
  EXPECT_CONTAINS(text, "wall.stiffness at most 1270 N/m");
  EXPECT_CONTAINS(text, "guard.damping at least 0.782 N s/m");
  EXPECT_CONTAINS(text, "all of them");
  EXPECT_EQ(text_for(with_damping(5, 1)).find("What would meet"), std::string::npos);
}

TEST(CheckTable, LinesFitATerminal) {
  ParameterValues values;
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  values.set_real<"wall.stiffness">(123456);
  values.set_real<"guard.operator_force">(0.001f);
  values.set_real<"guard.operator_speed">(3);
  const std::string text = text_for(values, {0.234, 540, 1.7, 147, 9.1});
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    EXPECT_LE(end - begin, 115u) << text.substr(begin, end - begin);
    begin = end + 1;
  }
}

}  // namespace kmax::check::judgement_test
