#include "control/stability_criteria.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace kmax::control::stability_criteria_test {
namespace {

template <typename Scalar>
constexpr Scalar infinite = std::numeric_limits<Scalar>::max();

// A desktop device at 500 Hz in a hand, all of it known.
template <typename Scalar>
constexpr StabilityCase<Scalar> desktop_case() {
  StabilityCase<Scalar> c;
  c.stiffness = Scalar(3580);
  c.magnetic_coefficient = 2;
  c.magnetic_length = Scalar(1e-3);
  c.period = Scalar(2e-3);
  c.quantum = Scalar(55e-6);
  c.mass = Scalar(0.045);
  c.damping = Scalar(0.05);
  c.friction = Scalar(0.093);
  c.operator_force = 1;
  c.operator_speed = Scalar(0.2);
  c.force_limit = Scalar(3.3);
  c.hand = {Scalar(0.234), 540, Scalar(1.7), 147, Scalar(9.1)};
  return c;
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

TEST(StabilityCriteria, ValuesAndBoundsOfOneCaseByHand) {
  const auto r = judge_all(desktop_case<double>());
  constexpr double expected[9][2] = {
      {3580, 50},      {3580, 50},          {3580, 1943.0935},  // 3rd: as by QR (sampled_stability_test.cpp)
      {3580, 50},      {0.2, 0.093 / 3.53}, {3580 * 0.2 * 2e-3, 1},
      {0.2, 1 / 7.16}, {4000, 50},          {1.3 / 3580, 165e-6}};
  constexpr bool passes[9] = {false, false, false, false, false, false, false, false, true};
  for (std::size_t i = 0; i < criterion_count; ++i) {
    // sigma = 0.093/(3580 * 55e-6) = 0.472 < 1/2: no speed brings rest.
    const double bound = i == 4 ? 0.0 : expected[i][1];
    EXPECT_NEAR(r[i].value, expected[i][0], 1e-12 * expected[i][0]) << i;
    EXPECT_NEAR(r[i].bound, bound, 1e-7 * bound) << i;
    EXPECT_EQ(r[i].pass, passes[i]) << i;
  }
  StabilityCase<double> finer = desktop_case<double>();
  finer.quantum = 50e-6;
  EXPECT_NEAR(judge(Criterion::diolaiti, finer).bound, 0.093 / 3.53, 1e-12);
}

// Every criterion with its value just inside and just beyond its bound, reached by changing what the value is
// made of.
template <typename Scalar>
void check_both_sides() {
  const auto just = [](Scalar value, int side) {
    return value *
           (Scalar(1) + static_cast<Scalar>(side) * Scalar(8) * std::numeric_limits<Scalar>::epsilon());
  };
  for (const int side : {-1, 1}) {
    const bool inside = side < 0;
    StabilityCase<Scalar> c = desktop_case<Scalar>();
    for (const Criterion criterion :
         {Criterion::colgate, Criterion::gil, Criterion::abbott_okamura, Criterion::resolution}) {
      c = desktop_case<Scalar>();
      const auto at = judge(criterion, c);
      c.stiffness = criterion == Criterion::resolution ? just(c.stiffness * at.bound / at.value, side)
                                                       : just(at.bound, side);
      EXPECT_EQ(judge(criterion, c).pass, inside) << static_cast<int>(criterion);
    }
    c = desktop_case<Scalar>();
    c.quantum = 0;  // by the hold alone
    c.operator_speed = just(judge(Criterion::diolaiti, c).bound, side);
    EXPECT_EQ(judge(Criterion::diolaiti, c).pass, inside);
    c = desktop_case<Scalar>();
    c.operator_speed = just(judge(Criterion::resolution_speed, c).bound, side);
    EXPECT_EQ(judge(Criterion::resolution_speed, c).pass, inside);
    c = desktop_case<Scalar>();
    c.magnetic_coefficient =
        just(judge(Criterion::field_slope, c).bound * c.magnetic_length * Scalar(0.5), side);
    EXPECT_EQ(judge(Criterion::field_slope, c).pass, inside);
    c = desktop_case<Scalar>();
    c.quantum = just(judge(Criterion::saturation_depth, c).value / Scalar(3), side);
    EXPECT_EQ(judge(Criterion::saturation_depth, c).pass, inside);
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
  const auto applies = [](Criterion criterion, const StabilityCase<double>& c) {
    const auto r = judge(criterion, c);
    EXPECT_TRUE(r.applies || r.pass);
    return r.applies;
  };
  const StabilityCase<double> all = desktop_case<double>();
  StabilityCase<double> c = all;
  c.operator_force = 0;
  EXPECT_FALSE(applies(Criterion::resolution, c));
  EXPECT_FALSE(applies(Criterion::resolution_speed, c));
  c = all;
  c.operator_speed = 0;
  EXPECT_FALSE(applies(Criterion::diolaiti, c));
  EXPECT_FALSE(applies(Criterion::resolution_speed, c));
  EXPECT_TRUE(applies(Criterion::resolution, c));  // by the quantum alone
  c = all;
  c.magnetic_coefficient = 0;
  EXPECT_FALSE(applies(Criterion::field_slope, c));
  c = all;
  c.force_limit = 0;
  EXPECT_FALSE(applies(Criterion::saturation_depth, c));
  c = all;
  c.mass = 0;
  EXPECT_FALSE(applies(Criterion::sampled_eigenvalues, c));
  c = all;
  c.delay = 8.001 * c.period;
  EXPECT_FALSE(applies(Criterion::sampled_eigenvalues, c));
  EXPECT_TRUE(applies(Criterion::colgate, c));
  // No wall: nothing but a field is left to judge.
  c = all;
  c.stiffness = 0;
  for (std::size_t i = 0; i < criterion_count; ++i)
    EXPECT_EQ(applies(static_cast<Criterion>(i), c), static_cast<Criterion>(i) == Criterion::field_slope)
        << i;
  c.wall_damping = 0.01;
  EXPECT_TRUE(applies(Criterion::colgate, c));
  EXPECT_TRUE(judge(Criterion::colgate, c).pass);
  c.wall_damping = -0.06;  // more than the device has
  EXPECT_FALSE(judge(Criterion::colgate, c).pass);
  EXPECT_FALSE(judge(Criterion::gil, c).pass);
  const auto unknown = judge(static_cast<Criterion>(200), all);
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

}  // namespace
}  // namespace kmax::control::stability_criteria_test
