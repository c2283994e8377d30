#include "host_tools/check/bent_loop.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "control/sampled_stability.hpp"
#include "control/stiffness_limits.hpp"
#include "tests/host_tools/check/drawn_bent_loop.hpp"

namespace kmax::check::bent_loop_test {

using control::LoopDraw;

/// A device of the Touch's class, half of whose mass is behind its published stiffness.
BentLoop touch() {
  return {{0.025, 0.5, 0.0, 1e-3, 0.3e-3, {}}, {.stiffness = 2310, .damping = 1, .handle_mass = 0.02}};
}
double rigid_limit(const BentLoop& loop, double more_mass) {
  control::SampledLoop<double> rigid = loop.motor_side;
  rigid.mass += more_mass;
  return control::largest_stable_stiffness(rigid);
}

TEST(BentLoop, AgreesWithEigenvaluesByQr) {
  LoopDraw draw(31);
  int bounded = 0, held = 0, light = 0, softer = 0;
  double worst = 0.0;
  for (int i = 0; i < 400; ++i) {
    const BentLoop loop = drawn_bent_loop(draw);
    const double limit = largest_stable_stiffness(loop);
    if (limit == 0.0) {
      EXPECT_GE(radius_by_eigenvalues(loop, 1e-3), 1.0 - 1e-12) << i;
      continue;
    }
    ++bounded;
    held += loop.motor_side.hand.hand_mass > 0.0;
    light += loop.structure.handle_mass < 0.05 * loop.motor_side.mass;
    softer += loop.structure.stiffness < limit;
    worst = std::max(worst, std::abs(radius_by_eigenvalues(loop, limit) - 1.0));
    // Stable all the way up to it, and not just above.
    for (double share = 1e-3; share < 0.999; share = share < 0.3 ? share * 2.0 : share + 0.07)
      EXPECT_LT(radius_by_eigenvalues(loop, share * limit), 1.0) << i << ' ' << share;
    EXPECT_LT(radius_by_eigenvalues(loop, 0.999 * limit), 1.0) << i;
    EXPECT_GT(radius_by_eigenvalues(loop, 1.001 * limit), 1.0) << i;
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(bounded, 300);
  EXPECT_GT(held, 100);
  EXPECT_GT(light, 40);
  EXPECT_GT(softer, 60);
}

TEST(BentLoop, StabilityAgreesWithEigenvaluesByQr) {
  LoopDraw draw(32);
  for (int i = 0; i < 300; ++i) {
    const BentLoop loop = drawn_bent_loop(draw);
    const double k = draw.log_uniform(1.0, 1e5), radius = radius_by_eigenvalues(loop, k);
    if (std::abs(radius - 1.0) > 1e-9) {
      EXPECT_EQ(is_stable(loop, k), radius < 1.0) << i;
    }
  }
}

// Colgate's bound is a guarantee for every passive load: whatever bends and holds, nothing below it is
// unstable.
RC_GTEST_PROP(BentLoop, NothingBelowColgatesBoundIsUnstable, (unsigned seed)) {
  LoopDraw draw(seed);
  const BentLoop loop = drawn_bent_loop(draw);
  const control::SampledLoop<double>& l = loop.motor_side;
  const double bound = control::colgate_stiffness_limit(l.damping, l.wall_damping, l.period, l.delay);
  RC_PRE(bound > 0.0);
  // What a delay of a part of a sample may cost (stiffness_limits.hpp). And a tip that is hardly damped
  // leaves so little between stable and not that rounding shifts the bound.
  const double gain = bound * (l.period / l.mass) * l.period;
  const double safe = bound * (1.0 - 0.0085 * gain / (0.5 + l.delay / l.period) - 1e-4);
  RC_ASSERT(largest_stable_stiffness(loop) > safe);
  RC_ASSERT(radius_by_eigenvalues(loop, safe * draw.uniform(0.1, 0.999)) < 1.0);
}

TEST(BentLoop, AStructureThatDoesNotBendIsRigid) {
  for (const auto& hand : {control::Hand<double>{}, {0.234, 540, 1.7, 147, 9.1}}) {
    BentLoop loop = touch();
    loop.motor_side.hand = hand;
    const double rigid = rigid_limit(loop, loop.structure.handle_mass);
    double before = 1.0;
    for (const double stiffness : {1e5, 1e6, 1e7, 1e8}) {
      loop.structure.stiffness = stiffness;
      const double error = std::abs(largest_stable_stiffness(loop) / rigid - 1.0);
      EXPECT_LT(error, before) << stiffness;
      before = error;
    }
    EXPECT_LT(before, 1e-3);
  }
}

TEST(BentLoop, ATipWithoutMassIsRigid) {
  BentLoop loop = touch();
  const double rigid = rigid_limit(loop, 0.0);
  for (const double damping : {0.0, 1.0}) {
    loop.structure.damping = damping;
    loop.structure.handle_mass = 1e-4;  // the least that is allowed
    EXPECT_NEAR(largest_stable_stiffness(loop), rigid, 0.01 * rigid);
    loop.structure.handle_mass = 1e-7;
    EXPECT_NEAR(largest_stable_stiffness(loop), rigid, 1e-4 * rigid);
  }
}

TEST(BentLoop, ATipOfRockIsGround) {
  // A handle held by rock through the structure: as one held by a rigid hand with that grip.
  BentLoop loop = touch();
  loop.structure.handle_mass = 1e6;
  control::SampledLoop<double> held = loop.motor_side;
  held.hand = {1e6, loop.structure.stiffness, loop.structure.damping, 0.0, 0.0};
  const double limit = control::largest_stable_stiffness(held);
  EXPECT_NEAR(largest_stable_stiffness(loop), limit, 1e-6 * limit);
}

TEST(BentLoop, AHandThatDoesNotGripIsNobody) {
  BentLoop loop = touch();
  const double alone = largest_stable_stiffness(loop);
  loop.motor_side.hand = {0.2, 0.0, 0.0, 150.0, 9.0};
  EXPECT_EQ(largest_stable_stiffness(loop), alone);
}

// What the walk along the unit circle steps over: a resonance and its antiresonance 0.1 % apart.
TEST(BentLoop, ASharpResonanceIsNotSteppedOver) {
  LoopDraw draw(33);
  for (int i = 0; i < 150; ++i) {
    BentLoop loop = drawn_bent_loop(draw);
    loop.structure.handle_mass = loop.motor_side.mass * draw.log_uniform(3e-4, 1e-2);
    loop.structure.damping = 0.0;
    const double limit = largest_stable_stiffness(loop);
    if (limit == 0.0) continue;
    EXPECT_LT(radius_by_eigenvalues(loop, 0.9999 * limit), 1.0) << i;
    EXPECT_GT(radius_by_eigenvalues(loop, 1.0001 * limit), 1.0) << i;
    for (double share = 0.02; share < 1.0; share += 0.02)
      EXPECT_LT(radius_by_eigenvalues(loop, share * limit), 1.0) << i << ' ' << share;
  }
}

// The ends of what --set allows, at the slowest and the fastest rate.
TEST(BentLoop, TheExtremesOfTheModel) {
  for (const double period : {5e-5, 1e-2}) {
    for (const double stiffness : {1.0, 1e8}) {
      for (const double damping : {0.0, 1000.0}) {
        for (const double handle_mass : {1e-4, 100.0}) {
          BentLoop loop = touch();
          loop.motor_side.period = period;
          loop.structure = {stiffness, damping, handle_mass};
          ASSERT_TRUE(can_be_judged(loop));
          const double limit = largest_stable_stiffness(loop);
          SCOPED_TRACE(testing::Message() << period << ' ' << stiffness << ' ' << damping << ' '
                                          << handle_mass << ": " << limit);
          ASSERT_GT(limit, 0.0);
          EXPECT_NEAR(radius_by_eigenvalues(loop, limit), 1.0, 1e-7);
          EXPECT_LT(radius_by_eigenvalues(loop, 0.99 * limit), 1.0);
          EXPECT_GT(radius_by_eigenvalues(loop, 1.01 * limit), 1.0);
        }
      }
    }
  }
}

TEST(BentLoop, WithoutDampingOfTheMotorNothingIsStable) {
  BentLoop loop = touch();
  loop.motor_side.damping = 0.0;
  EXPECT_EQ(largest_stable_stiffness(loop), 0.0) << "the structure's damper feels no rigid motion";
}

TEST(BentLoop, WhatIsNoLoopIsNotJudged) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), huge = 1e300;
  const auto judged = [](double stiffness, double damping, double handle_mass) {
    BentLoop loop = touch();
    loop.structure = {stiffness, damping, handle_mass};
    EXPECT_EQ(can_be_judged(loop), largest_stable_stiffness(loop) > 0.0);
    if (!can_be_judged(loop)) {
      EXPECT_FALSE(is_stable(loop, 100.0));
    }
    return can_be_judged(loop);
  };
  EXPECT_TRUE(judged(2310, 1, 0.02));
  EXPECT_TRUE(judged(2310, 0, 0.02));
  for (const double wrong : {nan, -1.0, huge}) {
    EXPECT_FALSE(judged(wrong, 1, 0.02)) << wrong;
    EXPECT_FALSE(judged(2310, wrong, 0.02)) << wrong;
  }
  EXPECT_FALSE(judged(0.0, 1, 0.02));
  for (const double wrong : {nan, -1.0, 0.0, 1e-300}) EXPECT_FALSE(judged(2310, 1, wrong)) << wrong;
  BentLoop loop = touch();
  loop.motor_side.mass = 0.0;
  EXPECT_FALSE(can_be_judged(loop));
  loop = touch();
  loop.motor_side.delay = 9e-3;
  EXPECT_FALSE(can_be_judged(loop));
  loop = touch();
  EXPECT_FALSE(is_stable(loop, nan));
}

TEST(BentLoop, AHandFeelsSpringsInSeries) {
  EXPECT_NEAR(felt_stiffness(4250, {.stiffness = 1020}), 822.6, 0.1);
  EXPECT_EQ(felt_stiffness(0, {.stiffness = 1020}), 0.0);
  EXPECT_NEAR(felt_stiffness(1e12, {.stiffness = 1020}), 1020, 1e-3);
}

}  // namespace kmax::check::bent_loop_test
