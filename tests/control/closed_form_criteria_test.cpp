#include "control/closed_form_criteria.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "control/wall_law.hpp"

namespace kmax::control::closed_form_criteria_test {

// Numbers that no two formulas share, and every part of a minimum the smaller one in turn.
constexpr StabilityCase<double> held_case{.stiffness = 1100.0,
                                          .wall_damping = -0.3,
                                          .magnetic_coefficient = 0.9,
                                          .magnetic_length = 1.3e-3,
                                          .period = 0.7e-3,
                                          .delay = 0.45e-3,
                                          .quantum = 45e-6,
                                          .mass = 0.05,
                                          .damping = 0.8,
                                          .friction = 0.06,
                                          .operator_force = 0.4,
                                          .operator_speed = 0.17,
                                          .detection_share = 0.6,
                                          .force_limit = 3.1,
                                          .hand = {}};

struct Expected {
  Criterion criterion;
  double value, bound;
  bool pass;
};

/// The formulas of the header's table, written out.
std::array<Expected, 8> formulas(const StabilityCase<double>& c) {
  const double k = c.stiffness, b = c.damping, wall = c.wall_damping, t = c.period, td = c.delay;
  const double slope = 2 * c.magnetic_coefficient / c.magnetic_length;
  const double colgate = (b - std::abs(wall)) / (t / 2 + td);
  const double gil = (b + wall) / (t / 2 + td);
  const double step = 2 * (c.friction / c.quantum - std::abs(wall) / t);
  const double abbott = std::min(2 * b / t, step), field = std::min(colgate, step);
  const double injected = k * (t / 2 + td) - b;
  const bool rests = c.friction / (k * c.quantum) >= 0.5;
  const double escape = !rests          ? 0.0
                        : injected <= 0 ? std::numeric_limits<double>::max()
                                        : c.friction / injected;
  const double force = k * std::max(c.quantum, c.detection_share * c.operator_speed * t);
  const double speed = c.operator_force / (k * c.detection_share * t);
  const double depth = (c.force_limit - c.magnetic_coefficient) / k;
  return {{{Criterion::colgate, k, colgate, k < colgate},
           {Criterion::gil, k, gil, k < gil},
           {Criterion::abbott_okamura, k, abbott, k <= abbott},
           {Criterion::diolaiti, c.operator_speed, escape, c.operator_speed < escape},
           {Criterion::resolution, force, c.operator_force, force <= c.operator_force},
           {Criterion::resolution_speed, c.operator_speed, speed, c.operator_speed <= speed},
           {Criterion::field_slope, slope, field, slope < field},
           {Criterion::saturation_depth, depth, 3 * c.quantum, depth >= 3 * c.quantum}}};
}

void expect_the_formulas(const StabilityCase<double>& c) {
  for (const Expected& expected : formulas(c)) {
    const auto result = judge_closed_form(expected.criterion, c);
    const int number = static_cast<int>(expected.criterion);
    EXPECT_EQ(result.criterion, expected.criterion);
    EXPECT_TRUE(result.applies) << number;
    EXPECT_EQ(result.pass, expected.pass) << number;
    EXPECT_EQ(result.at_least, expected.criterion == Criterion::saturation_depth) << number;
    EXPECT_NEAR(result.value, expected.value, 1e-12 * std::abs(expected.value)) << number;
    EXPECT_NEAR(result.bound, expected.bound, 1e-12 * std::abs(expected.bound)) << number;
  }
}

TEST(ClosedFormCriteria, AreTheFormulasOfTheTable) {
  StabilityCase<double> c = held_case;
  expect_the_formulas(c);  // abbott_okamura and field_slope by the hold
  c.friction = 0.03;
  expect_the_formulas(c);  // and by the step
  c.friction = 0.02;
  expect_the_formulas(c);  // where the handle does not rest
  c.friction = 5.0;
  c.operator_speed = 0.02;  // the quantum is the larger part of the force's step
  expect_the_formulas(c);
  c.stiffness = 100.0;
  c.wall_damping = 0.1;
  expect_the_formulas(c);  // everything passes
  c.delay = 0.0;
  expect_the_formulas(c);
}

// 2 N over 0.2 mm, counts of 0.055 mm, hardly any friction, a damper of 20 N s/m in the device. It
// buzzes, and Colgate's bound of 40,000 N/m does not see it.
TEST(ClosedFormCriteria, AFieldThatStepsBeyondTheFrictionFails) {
  const StabilityCase<double> c{.stiffness = 100.0,
                                .magnetic_coefficient = 2.0,
                                .magnetic_length = 0.2e-3,
                                .period = 1e-3,
                                .quantum = 55e-6,
                                .damping = 20.0,
                                .friction = 0.01,
                                .hand = {}};
  EXPECT_TRUE(judge_closed_form(Criterion::colgate, c).pass);
  EXPECT_TRUE(judge_closed_form(Criterion::abbott_okamura, c).pass);
  EXPECT_FALSE(judge_closed_form(Criterion::field_slope, c).pass);
}

TEST(ClosedFormCriteria, ADamperAloneIsJudgedByItsStep) {
  StabilityCase<double> c{
      .wall_damping = 1.0, .period = 1e-3, .quantum = 55e-6, .damping = 2.0, .friction = 0.056, .hand = {}};
  EXPECT_TRUE(judge_closed_form(Criterion::abbott_okamura, c).pass);
  c.friction = 0.054;
  const auto result = judge_closed_form(Criterion::abbott_okamura, c);
  EXPECT_TRUE(result.applies && !result.pass);
}

TEST(ClosedFormCriteria, TheEigenvaluesAreNotAmongThem) {
  const auto result = judge_closed_form(Criterion::sampled_eigenvalues, held_case);
  EXPECT_TRUE(!result.applies && result.pass);
}

TEST(ClosedFormCriteria, WhatIsLeftOutDoesNotApplyAndTheRestIsTheSame) {
  constexpr unsigned some = 1U << static_cast<unsigned>(Criterion::colgate) |
                            1U << static_cast<unsigned>(Criterion::field_slope) |
                            1U << static_cast<unsigned>(Criterion::abbott_okamura);
  for (const Criterion criterion : {Criterion::colgate, Criterion::field_slope, Criterion::abbott_okamura}) {
    const auto part = judge_closed_form<double, some>(criterion, held_case),
               whole = judge_closed_form(criterion, held_case);
    EXPECT_TRUE(part.applies);
    EXPECT_EQ(part.value, whole.value);
    EXPECT_EQ(part.bound, whole.bound);
    EXPECT_EQ(part.pass, whole.pass);
  }
  for (const Criterion criterion : {Criterion::gil, Criterion::diolaiti, Criterion::saturation_depth}) {
    const auto part = judge_closed_form<double, some>(criterion, held_case);
    EXPECT_TRUE(!part.applies && part.pass);
  }
}

TEST(SaturationDepth, PaperOnesStiffestWallSaturatesWithinThreeCounts) {
  const double depth = saturation_depth(8410.0, 2.0, 3.3);
  EXPECT_NEAR(depth, 0.1546e-3, 1e-7);
  EXPECT_LT(depth, saturation_quanta * 55e-6);
  EXPECT_GT(saturation_depth(3580.0, 0.0, 3.3), saturation_quanta * 55e-6);
}

TEST(ClosedFormCriteria, AtItsBoundASpeedPassesAndASlopeDoesNot) {
  StabilityCase<double> c = held_case;
  c.stiffness = 1024.0, c.period = 1.0 / 1024.0, c.detection_share = 0.5;
  c.operator_force = 1.0, c.operator_speed = 2.0;
  const auto speed = judge_closed_form(Criterion::resolution_speed, c);
  EXPECT_EQ(speed.value, speed.bound);
  EXPECT_TRUE(speed.pass);
  c.period = c.damping = 1.0, c.delay = 0.5, c.wall_damping = 0.0;
  c.magnetic_coefficient = 0.5, c.magnetic_length = 1.0;
  const auto slope = judge_closed_form(Criterion::field_slope, c);
  EXPECT_EQ(slope.value, slope.bound);
  EXPECT_FALSE(slope.pass);
}

// Of guard.criterion, and the bits of guard.failed.
TEST(ClosedFormCriteria, NumbersOfTheCriteriaStay) {
  using enum Criterion;
  int number = 0;
  for (const Criterion one : {colgate, gil, sampled_eigenvalues, abbott_okamura, diolaiti, resolution,
                              resolution_speed, field_slope, saturation_depth})
    EXPECT_EQ(static_cast<int>(one), number++);
}

TEST(SaturationDepth, Limits) {
  EXPECT_EQ(saturation_depth(1000.0, 4.0, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(1000.0, 3.3, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(0.0, 4.0, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(0.0, 1.0, 3.3), std::numeric_limits<double>::max());
}

RC_GTEST_PROP(SaturationDepth, IsWhereTheLawMeetsTheLimit, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  WallLawConfig<double> config;
  config.kind = WallKind::magnetic;
  config.stiffness = amount(10.0);
  config.magnetic_coefficient = amount(0.005);
  const double limit = config.magnetic_coefficient + amount(0.01);
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare(config, 1e-3);
  const double depth = saturation_depth(config.stiffness, config.magnetic_coefficient, limit);
  RC_ASSERT(std::abs(law.update(prepared, -depth, 0.0).force - limit) < 1e-12 * limit);
}

}  // namespace kmax::control::closed_form_criteria_test
