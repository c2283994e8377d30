#include "control/stability_criteria.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace kmax::control::stability_criteria_test {

template <typename Scalar>
constexpr Scalar infinite = std::numeric_limits<Scalar>::max();

// A desktop device at 500 Hz in a hand, all of it known.
template <typename Scalar>
constexpr StabilityCase<Scalar> desktop_case() {
  return {.stiffness = Scalar(3580),
          .magnetic_coefficient = 2,
          .magnetic_length = Scalar(1e-3),
          .period = Scalar(2e-3),
          .quantum = Scalar(55e-6),
          .mass = Scalar(0.045),
          .damping = Scalar(0.05),
          .friction = Scalar(0.093),
          .operator_force = 1,
          .operator_speed = Scalar(0.2),
          .force_limit = Scalar(3.3),
          .hand = {Scalar(0.234), 540, Scalar(1.7), 147, Scalar(9.1)}};
}

// The largest and the smallest finite number, zeros, denormals and everything between, by bit pattern.
template <typename Scalar, typename Bits>
rc::Gen<Scalar> any_finite() {
  return rc::gen::suchThat(
      rc::gen::oneOf(
          rc::gen::map(rc::gen::arbitrary<Bits>(), [](Bits b) { return std::bit_cast<Scalar>(b); }),
          rc::gen::map(rc::gen::inRange(-12, 8),
                       [](int e) { return static_cast<Scalar>(std::pow(10.0, e)); }),
          rc::gen::element(Scalar(0), std::numeric_limits<Scalar>::max(),
                           std::numeric_limits<Scalar>::lowest(), std::numeric_limits<Scalar>::min(),
                           std::numeric_limits<Scalar>::denorm_min(), Scalar(1), Scalar(1e-9))),
      [](Scalar value) { return std::isfinite(value); });
}

template <typename Scalar, typename Bits>
void check_that_all_is_finite() {
  const auto draw = [] { return *any_finite<Scalar, Bits>(); };
  StabilityCase<Scalar> c{draw(), draw(), draw(), draw(), draw(),
                          draw(), draw(), draw(), draw(), draw(),
                          draw(), draw(), draw(), draw(), {draw(), draw(), draw(), draw(), draw()}};
  // Half of the cases with no negative number but B, so that they are judged.
  if (*rc::gen::arbitrary<bool>()) {
    for (Scalar* s : {&c.stiffness, &c.magnetic_coefficient, &c.magnetic_length, &c.period, &c.delay,
                      &c.quantum, &c.mass, &c.damping, &c.friction, &c.operator_force, &c.operator_speed,
                      &c.detection_share, &c.force_limit, &c.hand.hand_mass, &c.hand.grip_stiffness,
                      &c.hand.grip_damping, &c.hand.arm_stiffness, &c.hand.arm_damping})
      *s = std::abs(*s);
  }
  for (const CriterionResult<Scalar>& r : judge_all(c)) {
    RC_ASSERT(std::isfinite(r.value) && std::isfinite(r.bound));
    RC_ASSERT(r.applies || r.pass);
  }
}

RC_GTEST_PROP(StabilityCriteria, FiniteForEveryFiniteFloat, ()) {
  check_that_all_is_finite<float, std::uint32_t>();
}
RC_GTEST_PROP(StabilityCriteria, FiniteForEveryFiniteDouble, ()) {
  check_that_all_is_finite<double, std::uint64_t>();
}

TEST(StabilityCriteria, WhatDoesNotApplyPassesWithoutNumbers) {
  auto free = desktop_case<double>();
  free.stiffness = free.wall_damping = free.magnetic_coefficient = 0.0;
  auto massless = desktop_case<double>();
  massless.mass = 0.0;
  for (const auto& c : {free, massless}) {
    for (const CriterionResult<double>& r : judge_all(c)) {
      if (r.criterion == Criterion::sampled_eigenvalues) {
        EXPECT_FALSE(r.applies);
        EXPECT_FALSE(r.at_least);
      }
      if (r.applies) continue;
      EXPECT_TRUE(r.pass);
      EXPECT_EQ(r.value, 0.0);
      EXPECT_EQ(r.bound, 0.0);
    }
  }
}

TEST(StabilityCriteria, NumbersAreAContract) {
  EXPECT_EQ(static_cast<int>(Criterion::colgate), 0);
  EXPECT_EQ(static_cast<int>(Criterion::gil), 1);
  EXPECT_EQ(static_cast<int>(Criterion::sampled_eigenvalues), 2);
  EXPECT_EQ(static_cast<int>(Criterion::abbott_okamura), 3);
  EXPECT_EQ(static_cast<int>(Criterion::diolaiti), 4);
  EXPECT_EQ(static_cast<int>(Criterion::resolution), 5);
  EXPECT_EQ(static_cast<int>(Criterion::resolution_speed), 6);
  EXPECT_EQ(static_cast<int>(Criterion::field_slope), 7);
  EXPECT_EQ(static_cast<int>(Criterion::saturation_depth), 8);
  const auto results = judge_all(desktop_case<double>());
  for (std::size_t i = 0; i < criterion_count; ++i) {
    EXPECT_EQ(static_cast<std::size_t>(results[i].criterion), i);
    EXPECT_TRUE(results[i].applies) << i;
    EXPECT_EQ(results[i].at_least, i == 8) << i;
  }
}

TEST(StabilityCriteria, AreTheClosedFormsAndTheEigenvalues) {
  const auto c = desktop_case<double>();
  for (const CriterionResult<double>& r : judge_all(c)) {
    if (r.criterion == Criterion::sampled_eigenvalues) {
      EXPECT_EQ(r.value, 3580.0);
      EXPECT_NEAR(r.bound, 1943.0935, 2e-4);  // as by QR (sampled_stability_test.cpp)
      EXPECT_FALSE(r.pass);
    } else {
      const auto expected = judge_closed_form(r.criterion, c);
      EXPECT_EQ(r.value, expected.value) << static_cast<int>(r.criterion);
      EXPECT_EQ(r.bound, expected.bound) << static_cast<int>(r.criterion);
      EXPECT_EQ(r.pass, expected.pass) << static_cast<int>(r.criterion);
    }
  }
}

// Every criterion with its value just inside and just beyond its bound, reached by changing what the value is
// made of.
template <typename Scalar>
void check_both_sides() {
  using C = Criterion;
  using Case = StabilityCase<Scalar>;
  for (const int side : {-1, 1}) {
    const Scalar just =
        Scalar(1) + static_cast<Scalar>(side) * Scalar(8) * std::numeric_limits<Scalar>::epsilon();
    const auto expect = [&](C criterion, Scalar Case::*field, Scalar boundary, Case c) {
      c.*field = boundary * just;
      EXPECT_EQ(judge(criterion, c).pass, side < 0) << static_cast<int>(criterion);
    };
    const Case c = desktop_case<Scalar>();
    Case by_the_hold = c;
    by_the_hold.quantum = 0;
    for (const C criterion : {C::colgate, C::gil, C::abbott_okamura})
      expect(criterion, &Case::stiffness, judge(criterion, c).bound, c);
    const auto resolution = judge(C::resolution, c);
    expect(C::resolution, &Case::stiffness, c.stiffness * resolution.bound / resolution.value, c);
    expect(C::diolaiti, &Case::operator_speed, judge(C::diolaiti, by_the_hold).bound, by_the_hold);
    expect(C::resolution_speed, &Case::operator_speed, judge(C::resolution_speed, c).bound, c);
    expect(C::field_slope, &Case::magnetic_coefficient,
           judge(C::field_slope, c).bound * c.magnetic_length * Scalar(0.5), c);
    expect(C::saturation_depth, &Case::quantum, judge(C::saturation_depth, c).value / Scalar(3), c);
  }
}

TEST(StabilityCriteria, BothSidesOfEveryBound) {
  check_both_sides<double>();
  check_both_sides<float>();
  for (const int side : {-1, 1}) {
    StabilityCase<double> c = desktop_case<double>();
    c.stiffness = judge(Criterion::sampled_eigenvalues, c).bound * (1 + side * 1e-9);
    EXPECT_EQ(judge(Criterion::sampled_eigenvalues, c).pass, side < 0);
  }
}

TEST(StabilityCriteria, ExactlyAtTheBoundAsTheSourcesSay) {
  StabilityCase<double> c;
  c.stiffness = 1000;
  c.damping = 1;
  c.period = 2e-3;
  c.friction = 0.5;
  c.quantum = 1e-3;
  c.operator_force = 1;
  EXPECT_EQ(judge(Criterion::colgate, c).bound, 1000.0);
  EXPECT_FALSE(judge(Criterion::colgate, c).pass);        // <
  EXPECT_FALSE(judge(Criterion::gil, c).pass);            // <
  EXPECT_TRUE(judge(Criterion::abbott_okamura, c).pass);  // <=
  EXPECT_TRUE(judge(Criterion::resolution, c).pass);      // <=
  c.force_limit = 3;
  EXPECT_TRUE(judge(Criterion::saturation_depth, c).pass);  // 3 mm are 3 quanta
}

TEST(StabilityCriteria, WhatIsNotKnownIsNotJudged) {
  using C = Criterion;
  const auto expect_left_out = [](const StabilityCase<double>& c, std::initializer_list<C> left_out) {
    for (std::size_t i = 0; i < criterion_count; ++i) {
      const auto r = judge(static_cast<C>(i), c);
      EXPECT_EQ(r.applies, std::find(left_out.begin(), left_out.end(), r.criterion) == left_out.end()) << i;
      EXPECT_TRUE(r.applies || r.pass) << i;
    }
  };
  const auto without = [](double StabilityCase<double>::*field, double value = 0) {
    StabilityCase<double> c = desktop_case<double>();
    c.*field = value;
    return c;
  };
  using Case = StabilityCase<double>;
  expect_left_out(without(&Case::operator_force), {C::resolution, C::resolution_speed});
  expect_left_out(without(&Case::operator_speed),
                  {C::diolaiti, C::resolution_speed});  // resolution by the quantum
  expect_left_out(without(&Case::magnetic_coefficient), {C::field_slope});
  expect_left_out(without(&Case::force_limit), {C::saturation_depth});
  expect_left_out(without(&Case::mass), {C::sampled_eigenvalues});
  expect_left_out(without(&Case::delay, 8.001 * desktop_case<double>().period), {C::sampled_eigenvalues});
  // No wall: nothing but a field is left to judge.
  Case c = without(&Case::stiffness);
  expect_left_out(c, {C::colgate, C::gil, C::sampled_eigenvalues, C::abbott_okamura, C::diolaiti,
                      C::resolution, C::resolution_speed, C::saturation_depth});
  c.wall_damping = 0.01;
  EXPECT_TRUE(judge(C::colgate, c).applies && judge(C::colgate, c).pass);
  c.wall_damping = -0.06;  // more than the device has
  EXPECT_FALSE(judge(C::colgate, c).pass);
  EXPECT_FALSE(judge(C::gil, c).pass);
  const auto unknown = judge(static_cast<C>(200), desktop_case<double>());
  EXPECT_TRUE(!unknown.applies && unknown.pass);
}

// A NaN in what a criterion reads never lets it pass.
TEST(StabilityCriteria, NotANumberDoesNotPass) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  using Field = double StabilityCase<double>::*;
  using C = StabilityCase<double>;
  const auto fails = [&](Criterion criterion, std::initializer_list<Field> fields) {
    for (const Field field : fields) {
      // Everything else so good that the criterion passes.
      C c = desktop_case<double>();
      c.stiffness = 1;
      c.magnetic_coefficient = 1e-6;
      c.operator_speed = 1e-3;
      c.force_limit = 100;
      ASSERT_TRUE(judge(criterion, c).applies && judge(criterion, c).pass) << static_cast<int>(criterion);
      c.*field = nan;
      const auto r = judge(criterion, c);
      EXPECT_TRUE(r.applies && !r.pass) << static_cast<int>(criterion);
    }
  };
  fails(Criterion::colgate, {&C::stiffness, &C::damping, &C::wall_damping, &C::period, &C::delay});
  fails(Criterion::gil, {&C::stiffness, &C::damping, &C::wall_damping, &C::period, &C::delay});
  fails(Criterion::abbott_okamura, {&C::stiffness, &C::damping, &C::friction, &C::period, &C::quantum});
  fails(Criterion::diolaiti, {&C::stiffness, &C::friction, &C::quantum, &C::operator_speed, &C::damping});
  fails(Criterion::resolution, {&C::stiffness, &C::detection_share, &C::operator_speed, &C::period,
                                &C::operator_force, &C::quantum});
  fails(Criterion::resolution_speed,
        {&C::stiffness, &C::detection_share, &C::operator_speed, &C::period, &C::operator_force});
  fails(Criterion::field_slope, {&C::magnetic_coefficient, &C::magnetic_length, &C::damping, &C::period});
  fails(Criterion::saturation_depth, {&C::stiffness, &C::magnetic_coefficient, &C::force_limit, &C::quantum});
}

// Metres to millimetres: forces kept, what has metres in it scaled; no verdict may change, and numbers scale.
RC_GTEST_PROP(StabilityCriteria, UnitsDoNotMatter, ()) {
  const auto scaled = [](double low, double high) {
    return low * std::pow(high / low, static_cast<double>(*rc::gen::inRange(0, 10001)) / 10000.0);
  };
  const double metre = std::ldexp(1.0, *rc::gen::inRange(-10, 11));  // a power of two: nothing is rounded
  StabilityCase<double> c;
  c.stiffness = scaled(10, 1e5);
  c.wall_damping = scaled(0.001, 0.1);
  c.magnetic_coefficient = scaled(0.1, 5);
  c.magnetic_length = scaled(1e-5, 1e-2);
  c.period = scaled(5e-5, 2e-3);
  c.delay = scaled(1e-5, 4e-4);
  c.quantum = scaled(1e-6, 1e-3);
  c.mass = scaled(0.01, 1);
  c.damping = scaled(0.01, 10);
  c.friction = scaled(0.01, 1);
  c.operator_force = scaled(0.1, 10);
  c.operator_speed = scaled(0.01, 1);
  c.force_limit = scaled(1, 10);
  c.hand = {scaled(0.1, 1), scaled(100, 1000), scaled(0.5, 5), scaled(50, 500), scaled(2, 20)};
  StabilityCase<double> other = c;
  for (double* per : {&other.stiffness, &other.wall_damping, &other.mass, &other.damping,
                      &other.hand.hand_mass, &other.hand.grip_stiffness, &other.hand.grip_damping,
                      &other.hand.arm_stiffness, &other.hand.arm_damping})
    *per /= metre;
  for (double* in : {&other.magnetic_length, &other.quantum, &other.operator_speed}) *in *= metre;
  for (std::size_t i = 0; i < criterion_count; ++i) {
    const auto criterion = static_cast<Criterion>(i);
    const auto one = judge(criterion, c), two = judge(criterion, other);
    const double unit = criterion == Criterion::resolution ? 1.0
                        : criterion == Criterion::diolaiti || criterion == Criterion::resolution_speed ||
                                criterion == Criterion::saturation_depth
                            ? metre
                            : 1.0 / metre;
    RC_ASSERT(one.pass == two.pass);
    RC_ASSERT(two.value == one.value * unit);
    RC_ASSERT(two.bound == one.bound * unit || one.bound == infinite<double>);
  }
}

// Usable at compile time, so a constant configuration can be checked by static_assert.
static_assert(judge(Criterion::colgate, desktop_case<float>()).applies);
static_assert(!judge(Criterion::colgate, desktop_case<float>()).pass);

TEST(CriterionResult, ItsDefaults) {
  const CriterionResult<double> defaults;
  EXPECT_EQ(defaults.criterion, Criterion::colgate);
  EXPECT_FALSE(defaults.applies);
  EXPECT_TRUE(defaults.pass);
  EXPECT_FALSE(defaults.at_least);
  EXPECT_EQ(defaults.value, 0.0);
  EXPECT_EQ(defaults.bound, 0.0);
}

}  // namespace kmax::control::stability_criteria_test
