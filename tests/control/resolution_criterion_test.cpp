#include "control/resolution_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace kmax::control::resolution_criterion_test {

constexpr double largest = std::numeric_limits<double>::max();

TEST(ResolutionCriterion, TheLargerOfQuantumAndWayInASample) {
  EXPECT_DOUBLE_EQ(force_step(1200.0, 1e-4, 1.0, 0.05, 1e-3), 0.12);  // 0.1 mm against 0.05 mm
  EXPECT_DOUBLE_EQ(force_step(1200.0, 1e-4, 1.0, 0.2, 1e-3), 0.24);   // against 0.2 mm
  EXPECT_DOUBLE_EQ(force_step(1200.0, 1e-4, 0.25, 0.2, 1e-3), 0.12);
  EXPECT_DOUBLE_EQ(force_step(1200.0, 0.0, 1.0, 0.0, 1e-3), 0.0);
}

// Paper 2 at K = 1.2 N/mm, 1 kHz, with the one F_h of 0.12 to 0.48 N that fits it.
TEST(ResolutionCriterion, PaperTwosObservations) {
  constexpr double held = 0.13;
  EXPECT_LE(force_step(1200.0, 1e-4, 1.0, 0.05, 1e-3), held);              // 0.1 mm: stable
  EXPECT_GT(force_step(1200.0, 4e-4, 1.0, 0.05, 1e-3), held);              // 0.4 mm: unstable
  EXPECT_NEAR(contact_speed_limit(1200.0, 1.0, 1e-3, held), 0.108, 1e-3);  // onset at about 100 mm/s
}

TEST(ResolutionCriterion, Limits) {
  EXPECT_EQ(contact_speed_limit(0.0, 1.0, 1e-3, 1.0), largest);
  EXPECT_EQ(contact_speed_limit(1000.0, 0.0, 1e-3, 1.0), largest);
  EXPECT_EQ(contact_speed_limit(1000.0, 1.0, 1e-3, 0.0), 0.0);
  EXPECT_EQ(force_step(largest, 1.0, 1.0, largest, largest), largest);
}

RC_GTEST_PROP(ResolutionCriterion, TheSpeedLimitIsWhereTheStepMeetsTheForce, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  const double k = amount(10.0), share = amount(1e-3), period = amount(1e-5), force = amount(0.01);
  const double speed = contact_speed_limit(k, share, period, force);
  RC_ASSERT(force_step(k, 0.0, share, speed * (1 - 1e-12), period) < force);
  RC_ASSERT(force_step(k, 0.0, share, speed * (1 + 1e-12), period) > force);
  RC_ASSERT(force_step(2 * k, 1e-9, share, speed, period) >= force_step(k, 1e-9, share, speed, period));
}

}  // namespace kmax::control::resolution_criterion_test
