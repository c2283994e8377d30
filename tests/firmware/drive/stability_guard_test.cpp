#include "firmware/drive/stability_guard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "firmware/drive/stability_case.hpp"
#include "tests/firmware/drive/guarded_parameters.hpp"

namespace kmax::firmware::stability_guard_test {
namespace {

using control::Criterion;
using Verdict = GuardFinding::Verdict;

constexpr float infinity = std::numeric_limits<float>::infinity();
float above(float value) {
  return std::nextafter(value, infinity);
}
float below(float value) {
  return std::nextafter(value, -infinity);
}

TEST_F(Guard, JudgesNothingWhenItIsOffHoweverBadTheSet) {
  set("guard.mode", 0);
  set("wall.stiffness", 1e6);
  set("guard.damping", 0);
  EXPECT_EQ(finding(), GuardFinding{});
}

TEST_F(Guard, JudgesTheSameWhetherItWarnsOrRefuses) {
  for (const double stiffness : {1000.0, 1e6}) {
    set("wall.stiffness", stiffness);
    set("guard.mode", 1);
    const GuardFinding warning = finding();
    set("guard.mode", 2);
    EXPECT_EQ(finding(), warning);
    EXPECT_EQ(warning.verdict == Verdict::fail, stiffness > 1000);
  }
}

TEST_F(Guard, JudgesNothingWhereNoWallIsRendered) {
  set("wall.stiffness", 1e6);
  set("wall.law", 0);
  EXPECT_EQ(finding(), GuardFinding{});
  set("wall.law", 1);
  for (const double mode : {1.0, 2.0}) {
    set("drive.mode", mode);
    EXPECT_EQ(finding(), GuardFinding{}) << mode;
  }
  set("drive.mode", 0);
  expect_fail(bit(Criterion::colgate) | bit(Criterion::abbott_okamura));
  // A law that makes no force.
  set("wall.stiffness", 0);
  EXPECT_EQ(finding(), GuardFinding{});
  // A damper alone is a wall.
  set("wall.damping", 4);
  expect_pass();
  set("wall.damping", 6);
  expect_fail(bit(Criterion::colgate));
}

TEST_F(Guard, AxesAreJudgedEachByItsOwn) {
  set("guard.mode", 2, 1);
  set("wall.stiffness", 1e6, 1);
  expect_pass();
  EXPECT_EQ(finding(1).verdict, Verdict::fail);
  EXPECT_EQ(finding(1).value, 1e6f);
}

// b / (T/2 + Td) = 5.325 / (250 us + 282.5 us) = 10,000 N/m, not to be reached.
TEST_F(Guard, ColgateOnBothSidesOfItsBound) {
  expect_pass();
  const float bound = finding().bound;
  EXPECT_EQ(finding().criterion, Criterion::colgate);
  EXPECT_EQ(finding().value, 1000.0f);
  EXPECT_NEAR(bound, 10'000.0f, 0.01f);
  values.set_real<"wall.stiffness">(below(bound));
  expect_pass();
  values.set_real<"wall.stiffness">(bound);
  expect_fail(bit(Criterion::colgate));
  EXPECT_EQ(finding().criterion, Criterion::colgate);
  EXPECT_EQ(finding().value, bound);
  EXPECT_EQ(finding().bound, bound);
  values.set_real<"wall.stiffness">(above(bound));
  expect_fail(bit(Criterion::colgate));
}

TEST_F(Guard, ColgateCountsDampingOfTheWallAndEveryDelay) {
  set("wall.damping", 2.13);
  EXPECT_NEAR(finding().bound, 6'000.0f, 0.01f);
  set("guard.delay", 0.0005);
  EXPECT_NEAR(finding().bound, 3.195f / 1032.5e-6f, 0.01f);
  set("haptic.rate", 20000);
  EXPECT_NEAR(finding().bound, 3.195f / 807.5e-6f, 0.01f);
  set("current.bandwidth", 1000);
  EXPECT_NEAR(finding().bound, 3.195f / 1557.5e-6f, 0.01f);
}

// 2 f_c / Delta = 2 * 0.01 / 10 um = 2000 N/m, which may be reached.
TEST_F(Guard, AbbottOkamuraOnBothSidesOfItsBound) {
  set("guard.friction", 0.01);
  const float bound = finding().bound;
  EXPECT_EQ(finding().criterion, Criterion::abbott_okamura);
  EXPECT_NEAR(bound, 2'000.0f, 0.01f);
  values.set_real<"wall.stiffness">(bound);
  expect_pass();
  values.set_real<"wall.stiffness">(above(bound));
  expect_fail(bit(Criterion::abbott_okamura));
  EXPECT_EQ(finding().criterion, Criterion::abbott_okamura);
  EXPECT_EQ(finding().value, above(bound));
  EXPECT_EQ(finding().bound, bound);
  // A coarser step lowers it.
  set("wall.stiffness", 1000);
  set("position.resolution", 30e-6);
  expect_fail(bit(Criterion::abbott_okamura));
  EXPECT_NEAR(finding().bound, 2'000.0f / 3.0f, 0.01f);
  // As does a damper: 2 (0.02 N / 30 um - 0.1 N s/m / 0.5 ms) = 933 N/m.
  set("guard.friction", 0.02);
  expect_pass();
  set("wall.damping", 0.1);
  expect_fail(bit(Criterion::abbott_okamura));
  EXPECT_NEAR(finding().bound, 2'800.0f / 3.0f, 0.01f);
  // Alone, it steps by 6 mN of 5.
  set("guard.friction", 0.005);
  set("wall.stiffness", 0);
  expect_fail(bit(Criterion::abbott_okamura));
}

// K eta = 1000 N/m * 10 um.
TEST_F(Guard, ResolutionOnBothSidesOfItsBoundAndOnlyWithAnOperator) {
  set("position.resolution", 0.001);
  set("guard.friction", 100);
  expect_pass();
  const float step = values.real<"wall.stiffness">() * stability_case(values, 0).quantum;
  EXPECT_NEAR(step, 1.0f, 1e-6f);
  values.set_real<"guard.operator_force">(step);
  expect_pass();
  EXPECT_EQ(finding().criterion, Criterion::resolution);
  values.set_real<"guard.operator_force">(below(step));
  expect_fail(bit(Criterion::resolution));
  EXPECT_EQ(finding().criterion, Criterion::resolution);
  EXPECT_EQ(finding().value, step);
  EXPECT_EQ(finding().bound, below(step));
  values.set_real<"guard.operator_force">(0.0f);
  expect_pass();
}

// F_h / (K T) = 0.1 N / (1000 N/m * 0.5 ms) = 0.2 m/s.
TEST_F(Guard, ResolutionSpeedOnBothSidesOfItsBound) {
  set("guard.operator_force", 0.1);
  expect_pass();
  const auto judged = [&] {
    return control::judge_closed_form(Criterion::resolution_speed, stability_case(values, 0));
  };
  EXPECT_FALSE(judged().applies) << "no speed is known";
  set("guard.operator_speed", 0.1);
  const float bound = judged().bound;
  EXPECT_NEAR(bound, 0.2f, 1e-6f);
  values.set_real<"guard.operator_speed">(bound);
  EXPECT_EQ(finding().failed & bit(Criterion::resolution_speed), 0U);
  values.set_real<"guard.operator_speed">(below(bound));
  EXPECT_EQ(finding().failed & bit(Criterion::resolution_speed), 0U);
  values.set_real<"guard.operator_speed">(above(bound));
  EXPECT_NE(finding().failed & bit(Criterion::resolution_speed), 0U);
  EXPECT_EQ(finding().verdict, Verdict::fail);
  set("guard.operator_speed", 0.3);
  expect_fail(bit(Criterion::resolution) | bit(Criterion::resolution_speed));
}

// 2 F_MC / x_0 = 2 * 5 N / 1 mm is the bound of 10,000 N/m, not to be reached.
TEST_F(Guard, FieldSlopeOnBothSidesOfItsBound) {
  set("wall.law", 2);
  set("wall.magnetic_coefficient", 4);
  expect_pass();
  const GuardFinding before = finding();
  EXPECT_EQ(before.criterion, Criterion::field_slope);
  EXPECT_FLOAT_EQ(before.value, 8'000.0f);
  // The smallest coefficient whose slope is no longer below the bound.
  float coefficient = 4.99f;
  const auto slope = [&](float force) { return force / (values.real<"wall.magnetic_length">() * 0.5f); };
  while (slope(coefficient) < before.bound) coefficient = above(coefficient);
  values.set_real<"wall.magnetic_coefficient">(below(coefficient));
  expect_pass();
  values.set_real<"wall.magnetic_coefficient">(coefficient);
  expect_fail(bit(Criterion::field_slope));
  EXPECT_EQ(finding().criterion, Criterion::field_slope);
  EXPECT_EQ(finding().bound, before.bound);
  EXPECT_GE(finding().value, before.bound);
  // The plain law has no field, whatever its parameters say.
  set("wall.law", 1);
  expect_pass();
}

// 2 N over 0.2 mm change by 1.1 N from one step of 55 um to the next.
TEST_F(Guard, FieldSlopeOnBothSidesOfWhatFrictionHolds) {
  set("wall.law", 2);
  set("wall.stiffness", 100);
  set("wall.magnetic_length", 2e-4);
  set("guard.damping", 20);
  set("position.resolution", 55e-6);
  set("guard.friction", 0.61);
  expect_pass();
  EXPECT_EQ(finding().criterion, Criterion::field_slope);
  EXPECT_NEAR(finding().bound, 2 * 0.61 / 60e-6, 0.01) << "six counts of 10 um";
  set("guard.friction", 0.59);
  expect_fail(bit(Criterion::field_slope));
  set("guard.friction", 0.01);
  expect_fail(bit(Criterion::field_slope));
  EXPECT_NEAR(finding().bound, 2 * 0.01 / 60e-6, 0.01);
}

TEST_F(Guard, AFieldAloneIsJudgedToo) {
  set("wall.law", 2);
  set("wall.stiffness", 0);
  set("wall.magnetic_coefficient", 20);
  expect_fail(bit(Criterion::field_slope));
  set("wall.magnetic_coefficient", 0);
  EXPECT_EQ(finding(), GuardFinding{});
}

TEST_F(Guard, WithoutDampingNoSpringPasses) {
  set("guard.damping", 0);
  set("wall.stiffness", 0.001);
  expect_fail(bit(Criterion::colgate) | bit(Criterion::abbott_okamura));
  EXPECT_EQ(finding().bound, 0.0f);
}

TEST_F(Guard, WithoutFrictionNoSpringPasses) {
  set("guard.friction", 0);
  set("wall.stiffness", 0.001);
  expect_fail(bit(Criterion::abbott_okamura));
  EXPECT_EQ(finding().bound, 0.0f);
}

TEST_F(Guard, MoreWallDampingThanTheDeviceHasGivesANegativeBound) {
  set("wall.damping", 7.455);
  expect_fail(bit(Criterion::colgate));
  EXPECT_NEAR(finding().bound, -4'000.0f, 0.01f);
  set("wall.stiffness", 0);
  expect_fail(bit(Criterion::colgate));
}

TEST_F(Guard, NamesTheFailedCriterionWithTheLeastMargin) {
  set("wall.stiffness", 20'000);  // colgate: twice its bound
  set("guard.friction", 0.05);    // abbott_okamura: twice its bound of 10,000 ...
  expect_fail(bit(Criterion::colgate) | bit(Criterion::abbott_okamura));
  set("guard.friction", 0.049);
  EXPECT_EQ(finding().criterion, Criterion::abbott_okamura);
  set("guard.friction", 0.051);
  EXPECT_EQ(finding().criterion, Criterion::colgate);
  // One that passes with no margin at all is not named while another fails.
  set("wall.stiffness", 1000);
  set("guard.friction", 0.0049);
  set("guard.damping", 0.54);
  expect_fail(bit(Criterion::abbott_okamura));
  EXPECT_EQ(finding().criterion, Criterion::abbott_okamura);
}

TEST_F(Guard, NamesTheOneFartherBeyondWhenNoValueCouldPass) {
  set("wall.damping", 7.455);
  set("guard.friction", 0);
  expect_fail(bit(Criterion::colgate) | bit(Criterion::abbott_okamura));
  EXPECT_EQ(finding().criterion, Criterion::colgate) << "1000 N/m where no value passes, the first of two";
  set("wall.law", 2);
  set("guard.friction", 1);
  set("wall.magnetic_coefficient", 0.6);
  EXPECT_EQ(finding().criterion, Criterion::field_slope) << "1200 beyond -4000 N/m";
  set("wall.magnetic_coefficient", 0.4);
  expect_fail(bit(Criterion::colgate) | bit(Criterion::field_slope));
  EXPECT_EQ(finding().criterion, Criterion::colgate);
  // One that no value could pass is worse than any that only this one does not.
  set("wall.damping", 0);
  set("wall.law", 1);
  set("guard.operator_force", 1e-3);
  set("guard.friction", 0);
  expect_fail(bit(Criterion::abbott_okamura) | bit(Criterion::resolution));
  EXPECT_EQ(finding().criterion, Criterion::abbott_okamura) << "not the step of 10 mN over 1";
}

TEST(GuardFinding, NumbersOfModesAndVerdictsAreTheProtocols) {
  EXPECT_EQ(static_cast<int>(GuardMode::off), 0);
  EXPECT_EQ(static_cast<int>(GuardMode::warn), 1);
  EXPECT_EQ(static_cast<int>(GuardMode::refuse), 2);
  EXPECT_EQ(static_cast<int>(Verdict::not_judged), 0);
  EXPECT_EQ(static_cast<int>(Verdict::pass), 1);
  EXPECT_EQ(static_cast<int>(Verdict::fail), 2);
}

}  // namespace
}  // namespace kmax::firmware::stability_guard_test
