#include "host_tools/check/judgement.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

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
  RC_ASSERT(margin.has_value() && std::isfinite(*margin));
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
  for (std::uint32_t estimator = 0; estimator < 5; ++estimator) {
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

}  // namespace kmax::check::judgement_test
