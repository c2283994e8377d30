#include "control/sampled_stability.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "tests/control/drawn_loop.hpp"
#include "tests/control/step_matrix.hpp"

namespace kmax::control::sampled_stability_test {

constexpr double unbounded = std::numeric_limits<double>::max();

SampledLoop<float> in_float(const SampledLoop<double>& l) {
  const auto f = [](double value) { return static_cast<float>(value); };
  return {f(l.mass),
          f(l.damping),
          f(l.wall_damping),
          f(l.period),
          f(l.delay),
          {f(l.hand.hand_mass), f(l.hand.grip_stiffness), f(l.hand.grip_damping), f(l.hand.arm_stiffness),
           f(l.hand.arm_damping)}};
}

TEST(RouthTest, KnowsTheSideOfEachZero) {
  LoopPolynomial<double> p;
  p.coefficient[0] = 1.0;
  for (int i = 1; i <= 13; ++i) p.multiply(i, 1.0);  // (s + 1)(s + 2) .. (s + 13)
  EXPECT_TRUE(all_in_left_half_plane(p));
  for (double& c : p.coefficient) c = -c;
  EXPECT_TRUE(all_in_left_half_plane(p));
  // s^2 + a s + 1 with a zero pair just left and just right of the axis, and on it; all coefficients
  // positive.
  for (const double a : {1e-6, 0.0, -1e-6}) {
    LoopPolynomial<double> q;
    q.coefficient = {1.0, a, 1.0};
    q.degree = 2;
    q.multiply(2.0, 1.0);
    q.multiply(3.0, 1.0);
    EXPECT_EQ(all_in_left_half_plane(q), a > 0.0) << a;
  }
}

// m x'' + b x' = -K x_k under a zero-order hold, nobody holding it: limits of an independent derivation.
TEST(SampledStability, SevenKnownLimits) {
  constexpr double known[7][4] = {{2e-3, 0.045, 0.5, 501.9},    {2e-3, 0.045, 1.0, 1007.5},
                                  {2e-3, 0.045, 3.58, 3677.5},  {2e-3, 0.045, 8.41, 8967.3},
                                  {1e-3, 0.045, 0.5, 1001.9},   {0.5e-3, 0.045, 1.0, 4007.4},
                                  {0.1e-3, 0.045, 1.0, 20007.4}};
  for (const auto& [period, mass, damping, limit] : known) {
    const SampledLoop<double> loop{mass, damping, 0.0, period, 0.0, {}};
    const double found = largest_stable_stiffness(loop);
    EXPECT_NEAR(found, limit, 1e-3 * limit);
    EXPECT_TRUE(is_stable(loop, 0.999999 * found));
    EXPECT_FALSE(is_stable(loop, 1.000001 * found));
    EXPECT_NEAR(largest_stable_stiffness(in_float(loop)), found, 1e-4 * found);
  }
}

// Jury's conditions of the second order, solved by hand: with a = e^{-bT/m}, K_max is where the product of
// the two eigenvalues is 1.
TEST(SampledStability, AgreesWithTheSecondOrderFormula) {
  LoopDraw draw(3);
  for (int i = 0; i < 300; ++i) {
    const SampledLoop<double> l{draw.log_uniform(1e-3, 10.0),
                                draw.log_uniform(1e-3, 10.0),
                                0.0,
                                draw.log_uniform(5e-5, 1e-2),
                                0.0,
                                {}};
    const double r = l.damping * l.period / l.mass, a = std::exp(-r), lost = -std::expm1(-r);
    // z^2 - (1 + a - K g1) z + a + K g0, g1 and g0 of the hold's answer.
    const double scale = l.mass / (l.damping * l.damping);
    const double series = r < 1e-3 ? r * r / 2.0 - r * r * r / 3.0 : lost - r * a;
    const double by_product = lost / (scale * series);
    const double by_minus_one = 2.0 * (1.0 + a) / (scale * ((r - lost) - series));
    const double limit = by_minus_one > 0.0 ? std::min(by_product, by_minus_one) : by_product;
    EXPECT_NEAR(largest_stable_stiffness(l), limit, 1e-5 * limit) << r;
  }
}

TEST(SampledStability, AgreesWithEigenvaluesByQr) {
  LoopDraw draw(11);
  int bounded = 0;
  double worst = 0.0;
  for (int i = 0; i < 1500; ++i) {
    const SampledLoop<double> loop = draw.loop();
    const double limit = largest_stable_stiffness(loop);
    if (limit == 0.0) {
      // Nothing above 0 is stable to begin with.
      for (const double k : {1e-3, 1e-1, 10.0})
        EXPECT_GE(radius_by_eigenvalues(loop, k), 1.0 - 1e-9) << i << ' ' << k;
      continue;
    }
    ASSERT_LT(limit, unbounded) << i;
    ++bounded;
    worst = std::max(worst, std::abs(radius_by_eigenvalues(loop, limit) - 1.0));
    // Stable all the way up to it, and not just above.
    for (double share = 1e-3; share < 0.999; share = share < 0.5 ? share * 1.6 : share + 0.04)
      EXPECT_LT(radius_by_eigenvalues(loop, share * limit), 1.0) << i << ' ' << share;
    EXPECT_LT(radius_by_eigenvalues(loop, 0.999 * limit), 1.0) << i;
    EXPECT_GT(radius_by_eigenvalues(loop, 1.001 * limit), 1.0) << i;
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(bounded, 1000);
  RecordProperty("worst_radius_error", std::to_string(worst));
}

TEST(SampledStability, StabilityAgreesWithEigenvaluesByQr) {
  LoopDraw draw(12);
  for (int i = 0; i < 500; ++i) {
    const SampledLoop<double> loop = draw.loop();
    const double k = draw.log_uniform(1.0, 1e5), radius = radius_by_eigenvalues(loop, k);
    if (std::abs(radius - 1.0) > 1e-6) {
      EXPECT_EQ(is_stable(loop, k), radius < 1.0) << i;
    }
  }
}

// Float against double over loops that a controller can meet.
TEST(SampledStability, FloatIsCloseToDouble) {
  LoopDraw draw(13);
  double worst = 0.0;
  int compared = 0;
  while (compared < 1500) {
    const SampledLoop<double> loop = draw.loop();
    const double exact = largest_stable_stiffness(loop);
    if (exact == 0.0) continue;
    ++compared;
    const double single = static_cast<double>(largest_stable_stiffness(in_float(loop)));
    worst = std::max(worst, std::abs(single - exact) / exact);
  }
  std::printf("largest_stable_stiffness in float: worst relative error %.2g\n", worst);
  EXPECT_LT(worst, 1e-4);
}

TEST(SampledStability, AHandleThatNobodyHoldsIsFree) {
  const SampledLoop<double> alone{0.045, 0.5, 0.0, 1e-3, 0.0, {}};
  EXPECT_FALSE(is_stable(alone, 0.0));
  for (const double k : {1e-9, 1e-6, 1e-3, 1.0}) EXPECT_TRUE(is_stable(alone, k)) << k;
  EXPECT_FALSE(is_stable(alone, -1e-3));
  SampledLoop<double> held = alone;
  held.hand = {0.234, 540, 1.7, 147, 9.1};
  EXPECT_TRUE(is_stable(held, 0.0));
  // An arm without a spring: the pair drifts as one.
  held.hand.arm_stiffness = 0.0;
  EXPECT_FALSE(is_stable(held, 0.0));
  EXPECT_TRUE(is_stable(held, 1e-3));
}

TEST(SampledStability, WithoutAnyDampingNothingIsStable) {
  SampledLoop<double> loop{0.045, 0.0, 0.0, 1e-3, 0.0, {}};
  EXPECT_EQ(largest_stable_stiffness(loop), 0.0);
  EXPECT_FALSE(is_stable(loop, 10.0));
  loop.hand = {0.2, 500, 0, 150, 0};
  EXPECT_EQ(largest_stable_stiffness(loop), 0.0);
  // Free masses joined by a spring and, in the second, a damper between them that the rigid motion never
  // feels.
  loop.hand = {0.2, 500, 2, 0, 0};
  EXPECT_EQ(largest_stable_stiffness(loop), 0.0);
  // Damping by the wall alone.
  loop.hand = {};
  loop.wall_damping = 1.0;
  EXPECT_GT(largest_stable_stiffness(loop), 1000.0);
}

TEST(SampledStability, HandsThatAreHardlyThere) {
  const SampledLoop<double> alone{0.045, 0.5, 0.0, 1e-3, 0.3e-3, {}};
  const double limit = largest_stable_stiffness(alone);
  const auto with = [&](const Hand<double>& hand) {
    SampledLoop<double> loop = alone;
    loop.hand = hand;
    return largest_stable_stiffness(loop);
  };
  EXPECT_EQ(with({0.2, 0, 0, 150, 9}), limit);  // does not grip
  EXPECT_NEAR(with({0.2, 1e-6, 1e-9, 150, 9}), limit, 1e-6 * limit);
  EXPECT_NEAR(with({1e-9, 1.0, 1e-7, 1e-6, 1e-9}), limit, 1e-3 * limit);  // a feather
  EXPECT_GT(with({0.2, 0, 2, 0, 9}),
            limit);  // a damper only (order 3), and the same with a spring of next to nothing
  EXPECT_NEAR(with({0.2, 0, 2, 0, 9}), with({0.2, 1e-6, 2, 1e-6, 9}), 1e-4 * limit);
  // Gripped by rock through a damper: as much damping more.
  SampledLoop<double> damped = alone;
  damped.damping += 2.0;
  EXPECT_NEAR(with({1e6, 0, 2, 0, 0}), largest_stable_stiffness(damped), 1e-4 * limit);
}

TEST(SampledStability, DelayIsContinuousAcrossWholeSamples) {
  SampledLoop<double> loop{0.045, 0.5, 0.3, 1e-3, 0.0, {0.234, 540, 1.7, 147, 9.1}};
  for (int whole = 1; whole <= 8; ++whole) {
    double limit[3];
    for (int i = 0; i < 3; ++i) {
      loop.delay = 1e-3 * whole * (1.0 + (i - 2) * 1e-9);
      limit[i] = largest_stable_stiffness(loop);
      ASSERT_GT(limit[i], 0.0);
    }
    EXPECT_NEAR(limit[0], limit[2], 1e-6 * limit[2]) << whole;
    EXPECT_NEAR(limit[1], limit[2], 1e-6 * limit[2]) << whole;
  }
  loop.delay = 8.0001e-3;
  EXPECT_FALSE(can_be_judged(loop));
  EXPECT_EQ(largest_stable_stiffness(loop), 0.0);
  EXPECT_FALSE(is_stable(loop, 100.0));
}

// From a nanosecond to a second per sample; the linear limit is met when sampling is fast.
TEST(SampledStability, AnySamplePeriod) {
  for (double period = 1.0; period > 0.9e-9; period /= 10.0) {
    const SampledLoop<double> loop{0.045, 1.0, 0.0, period, 0.0, {}};
    const double limit = largest_stable_stiffness(loop);
    EXPECT_TRUE(std::isfinite(limit));
    if (period < 1e-3) {
      EXPECT_NEAR(limit, 2.0 / period, 2e-2 * limit) << period;
    }
    EXPECT_GT(limit, 0.0);
  }
}

// A resonance of the hand with next to no damping: the walk along the circle must not step over it.
TEST(SampledStability, SharpResonancesAreNotSteppedOver) {
  LoopDraw draw(14);
  for (const double ratio : {1e-2, 1e-3, 1e-4}) {
    for (int i = 0; i < 60; ++i) {
      SampledLoop<double> loop = draw.loop();
      loop.hand = draw.hand();
      Hand<double>& h = loop.hand;
      h.arm_damping = 2.0 * ratio * std::sqrt((h.arm_stiffness + h.grip_stiffness) * h.hand_mass);
      h.grip_damping = 0.3 * h.arm_damping;
      const double limit = largest_stable_stiffness(loop);
      for (int k = 1; k < 1000; ++k) ASSERT_TRUE(limit == 0.0 || is_stable(loop, limit * k / 1000.0)) << i;
    }
  }
}

// The hand's resonance makes a dip in the phase that is narrower than a step of the walk: stepped over, the
// limit would be the next mode's, 653.2 N/m.
TEST(SampledStability, ADipBetweenTwoStepsIsTheLimit) {
  const SampledLoop<double> loop{
      0.062535, 1.6959, 0.0, 0.00105251, 0.00210502, {0.0684268, 59.0055, 3.69864e-05, 12.4563, 0.000123288}};
  const double limit = largest_stable_stiffness(loop);
  EXPECT_NEAR(limit, 652.34, 1e-2);
  EXPECT_LT(radius_by_eigenvalues(loop, 652.3), 1.0);
  EXPECT_GT(radius_by_eigenvalues(loop, 652.6), 1.0);
}

RC_GTEST_PROP(SampledStability, NobodyHolding_SlowerSamplingDelayAndLessDampingNeverHelp, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  SampledLoop<double> loop{amount(1e-3), amount(1e-2), 0.0, amount(5e-6), 0.0, {}};
  loop.delay = loop.period * *rc::gen::inRange(0, 60) * 0.1;
  const double limit = largest_stable_stiffness(loop);
  SampledLoop<double> worse = loop;
  worse.delay += 0.5 * loop.period;
  RC_ASSERT(largest_stable_stiffness(worse) < limit);
  worse = loop;
  worse.period *= 1.25;
  RC_ASSERT(largest_stable_stiffness(worse) < limit);
  worse = loop;
  worse.damping *= 0.9;
  RC_ASSERT(largest_stable_stiffness(worse) < limit);
}

// Time in other units, and mass in others: numbers scale, nothing else.
RC_GTEST_PROP(SampledStability, ScalesWithTimeAndMass, ()) {
  LoopDraw draw(static_cast<unsigned>(*rc::gen::inRange(0, 1 << 30)));
  const SampledLoop<double> loop = draw.loop();
  const double time = std::ldexp(1.0, *rc::gen::inRange(-10, 11)),
               mass = std::ldexp(1.0, *rc::gen::inRange(-10, 11));
  SampledLoop<double> other = loop;
  other.mass *= mass;
  other.hand.hand_mass *= mass;
  other.period *= time;
  other.delay *= time;
  for (double* damping :
       {&other.damping, &other.wall_damping, &other.hand.grip_damping, &other.hand.arm_damping})
    *damping *= mass / time;
  for (double* stiffness : {&other.hand.grip_stiffness, &other.hand.arm_stiffness})
    *stiffness *= mass / (time * time);
  RC_ASSERT(largest_stable_stiffness(other) == largest_stable_stiffness(loop) * mass / (time * time));
}

TEST(SampledStability, ALoopWithAnyNegativePartIsNotJudged) {
  constexpr SampledLoop<double> good{.mass = 0.1,
                                     .damping = 0.1,
                                     .period = 1e-3,
                                     .delay = 1e-3,
                                     .hand = {.hand_mass = 1.0,
                                              .grip_stiffness = 1.0,
                                              .grip_damping = 1.0,
                                              .arm_stiffness = 1.0,
                                              .arm_damping = 1.0}};
  EXPECT_TRUE(can_be_judged(good));
  using Loop = SampledLoop<double>;
  for (double Loop::*part : {&Loop::mass, &Loop::damping, &Loop::period, &Loop::delay}) {
    Loop loop = good;
    loop.*part = -1e-4;
    EXPECT_FALSE(can_be_judged(loop));
  }
  using Hands = Hand<double>;
  for (double Hands::*part : {&Hands::hand_mass, &Hands::grip_stiffness, &Hands::grip_damping,
                              &Hands::arm_stiffness, &Hands::arm_damping}) {
    Loop loop = good;
    loop.hand.*part = -1e-4;
    EXPECT_FALSE(can_be_judged(loop));
  }
}

}  // namespace kmax::control::sampled_stability_test
