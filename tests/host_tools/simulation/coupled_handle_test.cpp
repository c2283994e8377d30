#include "host_tools/simulation/coupled_handle.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/host_tools/simulation/drawn_models.hpp"

namespace kmax::simulation::coupled_handle_test {
namespace {

constexpr double period = 0.002;

DeviceModel bare(double mass, double damping, double friction = 0.0) {
  return {mass, damping, friction, 0.0};
}

// --- The sampled wall without hand and friction: exact answers exist.

bool oscillation_grows(double period_s, double mass, double damping, double stiffness) {
  CoupledHandle handle(bare(mass, damping), HandleStart{1e-3, 0.0});
  const int samples = static_cast<int>(60.0 / period_s);
  double early = 0.0;
  double late = 0.0;
  for (int n = 0; n < samples; ++n) {
    handle.advance(-stiffness * handle.position(), 0.0, period_s);
    const double size = std::abs(handle.position());
    if (size > 1.0) return true;
    if (size < 1e-9 && n % 64 == 0 && std::abs(handle.velocity()) < 1e-7) return false;
    if (n >= samples / 10 && n < samples / 5) early = std::max(early, size);
    if (n >= samples * 9 / 10) late = std::max(late, size);
  }
  return late > early;
}

TEST(CoupledHandle, MeetsTheExactLinearLimits) {
  struct Limit {
    double period_s, mass, damping, stiffness;
  };
  // m x'' + b x' = -K x_k under a zero-order hold; from the poles of the sampled system.
  for (const Limit& limit :
       {Limit{0.002, 0.045, 0.5, 501.9}, Limit{0.002, 0.045, 1.0, 1007.5}, Limit{0.002, 0.045, 3.58, 3677.5},
        Limit{0.002, 0.045, 8.41, 8967.3}, Limit{0.001, 0.045, 0.5, 1001.9},
        Limit{0.0005, 0.045, 1.0, 4007.4}, Limit{0.0001, 0.045, 1.0, 20007.4}}) {
    double low = 0.5 * limit.stiffness;
    double high = 2.0 * limit.stiffness;
    while (high - low > 1e-5 * limit.stiffness) {
      const double middle = 0.5 * (low + high);
      (oscillation_grows(limit.period_s, limit.mass, limit.damping, middle) ? high : low) = middle;
    }
    EXPECT_NEAR(low / limit.stiffness, 1.0, 2e-4) << "T " << limit.period_s << " b " << limit.damping;
  }
}

// --- Closed forms with friction.

TEST(CoupledHandle, FrictionStopsTheHandleWhereItMust) {
  // m v0 / f_c = 45e-3 * 0.1 / 0.1 = 45 ms, x = m v0^2 / (2 f_c) = 2.25 mm.
  for (const double interval : {0.002, 50e-6, 0.0071, 0.5}) {
    CoupledHandle handle(bare(0.045, 0.0, 0.1), HandleStart{0.0, 0.1});
    for (int n = 0; n * interval < 0.06; ++n) handle.advance(0.0, 0.0, interval);
    EXPECT_TRUE(handle.sticking());
    EXPECT_EQ(handle.velocity(), 0.0);
    EXPECT_NEAR(handle.position(), 2.25e-3, 1e-15);
  }
}

TEST(CoupledHandle, ReversesInsideAnInterval) {
  // Decelerates with (F + f_c)/m to x' = 0, then accelerates back with (F - f_c)/m.
  const double mass = 0.05;
  const double friction = 0.1;
  const double force = 0.5;
  CoupledHandle handle(bare(mass, 0.0, friction), HandleStart{0.0, 0.006});
  handle.advance(-force, 0.0, period);
  const double stop = 0.006 * mass / (force + friction);
  ASSERT_LT(stop, period);
  const double turn = 0.006 * stop / 2.0;
  const double back = period - stop;
  EXPECT_NEAR(handle.velocity(), -(force - friction) / mass * back, 1e-15);
  EXPECT_NEAR(handle.position(), turn - (force - friction) / mass * back * back / 2.0, 1e-17);
  EXPECT_FALSE(handle.sticking());
}

TEST(CoupledHandle, SticksExactlyUpToTheFriction) {
  CoupledHandle handle(bare(0.045, 0.05, 0.093), HandleStart{0.0123, 0.0});
  for (int n = 0; n < 10000; ++n) {
    handle.advance(n % 2 == 0 ? 0.093 : -0.093, 0.0, period);
    ASSERT_EQ(handle.position(), 0.0123);
    ASSERT_EQ(handle.velocity(), 0.0);
    ASSERT_TRUE(handle.sticking());
  }
  handle.advance(0.0931, 0.0, period);
  EXPECT_GT(handle.position(), 0.0123);
  EXPECT_FALSE(handle.sticking());
}

TEST(CoupledHandle, BreaksAwayInsideAnIntervalWhenTheHandHasPulledEnough) {
  // A hand that moves away from a stuck handle: nothing, then a slip. The moment does not depend on the
  // intervals.
  DeviceModel device;
  OperatorModel person;
  IntendedMotionConfig motion;
  motion.approach_speed = 0.01;
  CoupledHandle coarse(device, person, motion);
  CoupledHandle fine(device, person, motion);
  coarse.begin_motion();
  fine.begin_motion();
  int stuck_samples = 0;
  for (int n = 0; n < 100; ++n) {
    coarse.advance(0.0, 0.0, period);
    for (int part = 0; part < 40; ++part) fine.advance(0.0, 0.0, period / 40);
    stuck_samples += coarse.sticking() ? 1 : 0;
    ASSERT_NEAR(coarse.position(), fine.position(), 1e-14) << n;
    ASSERT_NEAR(coarse.velocity(), fine.velocity(), 1e-12) << n;
  }
  EXPECT_GT(stuck_samples, 5);
  EXPECT_LT(stuck_samples, 95);
}

TEST(CoupledHandle, WithoutFrictionItRestsButNeverSticks) {
  CoupledHandle handle(bare(0.045, 0.05), HandleStart{0.01, 0.0});
  handle.advance(0.0, 0.0, period);
  EXPECT_FALSE(handle.sticking());
  EXPECT_EQ(handle.position(), 0.01);
}

TEST(CoupledHandle, SurvivesExactCoincidences) {
  // Stops at the very end of an interval, with a net force of exactly the friction, again and again.
  CoupledHandle handle(bare(0.0625, 0.0, 0.125), HandleStart{0.0, 0.0});
  for (int n = 0; n < 1000; ++n) {
    handle.advance(n % 2 == 0 ? 0.375 : -0.125, 0.0, 0x1p-9);  // up by 4 m/s^2, down by 4 m/s^2
    if (n % 2 == 1) {
      ASSERT_NEAR(handle.velocity(), 0.0, 1e-15) << n;
    }
  }
  EXPECT_NEAR(handle.position(), 500 * 4.0 * 0x1p-18, 1e-12);
  EXPECT_EQ(handle.event_limit_hits(), 0u);
}

TEST(CoupledHandle, ThousandsOfBreakAwaysNeverMeetTheEventLimit) {
  DeviceModel device;
  device.friction = 0.3;
  OperatorModel person;
  IntendedMotionConfig motion;
  motion.approach_speed = 0.01;
  motion.start_position = 10.0;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  CoupledHandle handle(device, person, motion);
  handle.begin_motion();
  int break_aways = 0;
  for (int n = 0; n < 200000; ++n) {
    const bool stuck = handle.sticking();
    handle.advance(uniform(random), 0.0, period);
    break_aways += stuck && !handle.sticking() ? 1 : 0;
  }
  EXPECT_GT(break_aways, 1000);
  EXPECT_EQ(handle.event_limit_hits(), 0u);
}

// --- Energy.

TEST(CoupledHandle, LosslessSceneKeepsItsEnergy) {
  OperatorModel person;
  person.grip_damping = 0.0;
  person.arm_damping = 0.0;
  IntendedMotionConfig motion;
  for (const double interval : {50e-6, 0.002, 0.0137}) {
    CoupledHandle handle(bare(0.045, 0.0), person, motion, HandleStart{motion.start_position, 0.5});
    const double energy = handle.energy();
    EXPECT_DOUBLE_EQ(energy, 0.5 * 0.045 * 0.25);
    double farthest = 0.0;
    for (int n = 0; n < 100000; ++n) {
      handle.advance(0.0, 0.0, interval);
      farthest = std::max(farthest, std::abs(handle.hand_position() - motion.start_position));
    }
    EXPECT_NEAR(handle.energy() / energy, 1.0, 1e-9) << interval;
    EXPECT_GT(farthest, 1e-3);
  }
}

RC_GTEST_PROP(CoupledHandle, WithoutAPersonEnergyNeverExceedsTheWorkOfTheMotor, ()) {
  CoupledHandle handle(bare(0.045, *rc::gen::inRange(0, 20) * 0.1, *rc::gen::inRange(0, 20) * 0.01),
                       HandleStart{0.0, *rc::gen::inRange(-10, 11) * 0.05});
  require_no_energy_from_nowhere(handle, 50, period);
}

// --- Intervals.

TEST(CoupledHandle, DividingAnIntervalChangesNothingButRounding) {
  const DeviceModel device;
  const OperatorModel person;
  const IntendedMotionConfig motion;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  CoupledHandle coarse(device, person, motion);
  CoupledHandle fine(device, person, motion);
  coarse.begin_motion();
  fine.begin_motion();
  for (int n = 0; n < 2000; ++n) {
    const double force = uniform(random);
    coarse.advance(force, 0.0, period);
    for (int part = 0; part < 7; ++part) fine.advance(force, 0.0, period / 7);
    ASSERT_NEAR(coarse.position(), fine.position(), 1e-12) << n;
    ASSERT_NEAR(coarse.velocity(), fine.velocity(), 1e-10) << n;
  }
}

TEST(CoupledHandle, ConstantActivationPerIntervalIsASmallErrorAndShrinksQuadratically) {
  const DeviceModel device{0.045, 0.05, 0.0, 0.0};
  const OperatorModel person;
  IntendedMotionConfig motion;
  motion.start_position = 0.0;
  const auto run = [&](double interval) {
    CoupledHandle handle(device, person, motion);
    handle.begin_motion();
    for (int n = 0; n < static_cast<int>(std::lround(0.2 / interval)); ++n)
      handle.advance(2.0, 2.0, interval);
    return handle.position();
  };
  const double exact = run(12.5e-6);
  const double at_2_ms = std::abs(run(0.002) - exact);
  const double at_1_ms = std::abs(run(0.001) - exact);
  EXPECT_LT(at_2_ms, 1e-6);
  EXPECT_LT(at_1_ms, 0.3 * at_2_ms);
}

// --- The person.

TEST(CoupledHandle, PressesWithThePushPlusTheFieldOnEitherSideOfTheWall) {
  for (const double side : {1.0, -1.0}) {
    DeviceModel device;
    device.friction = 100.0;  // the handle is held at the surface
    const OperatorModel person;
    IntendedMotionConfig motion;
    motion.wall_position = 0.003;
    motion.start_position = 0.003;
    motion.wall_side = side;
    motion.hold_time = 1000.0;
    CoupledHandle handle(device, person, motion);
    handle.begin_motion();
    for (int n = 0; n < 10000; ++n) handle.advance(2.0 * side, 2.0, period);
    EXPECT_EQ(handle.position(), 0.003);
    EXPECT_NEAR(handle.gain(), 1.0 + 0.574 * 2.0, 1e-12);
    const double pressing =
        handle.gain() * person.grip_stiffness * (handle.hand_position() - handle.position());
    EXPECT_NEAR(pressing, -side * (motion.push_force + 2.0), 1e-9);
  }
}

TEST(CoupledHandle, ActivationIsAFirstOrderLagOfTheBackgroundForce) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  for (int n = 0; n < 200; ++n)
    handle.advance(0.0, n % 2 == 0 ? 2.0 : -2.0, period);  // a magnitude: the sign is ignored
  EXPECT_NEAR(handle.activation(), 2.0 * (1.0 - std::exp(-1.0)), 1e-12);
  EXPECT_NEAR(handle.gain(), 1.0 + 0.574 * 2.0 * (1.0 - std::exp(-0.399 / 0.4)), 1e-12);
}

TEST(CoupledHandle, MirroredSceneMovesMirrored) {
  const DeviceModel device;
  const OperatorModel person;
  IntendedMotionConfig motion;
  IntendedMotionConfig mirror = motion;
  mirror.start_position = -motion.start_position;
  mirror.wall_side = -1.0;
  CoupledHandle right(device, person, motion);
  CoupledHandle left(device, person, mirror);
  right.begin_motion();
  left.begin_motion();
  for (int n = 0; n < 1000; ++n) {
    const double depth = -right.position();
    const double force = depth > 0.0 ? 6000.0 * depth + 1.0 : 0.0;
    right.advance(force, 1.0, period);
    left.advance(-force, 1.0, period);
    ASSERT_EQ(right.position(), -left.position()) << n;
    ASSERT_EQ(right.velocity(), -left.velocity()) << n;
  }
}

TEST(CoupledHandle, StaysAtRestUntilTheMotionBegins) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  for (int n = 0; n < 1000; ++n) handle.advance(0.0, 0.0, 50e-6);
  EXPECT_EQ(handle.position(), 0.02);
  EXPECT_EQ(handle.intended_position(), 0.02);
  EXPECT_TRUE(handle.sticking());
  handle.begin_motion();
  for (int n = 0; n < 2000; ++n) handle.advance(0.0, 0.0, 50e-6);
  EXPECT_LT(handle.position(), 0.015);
}

TEST(CoupledHandle, WithoutAPersonThereIsNoMotion) {
  CoupledHandle handle{DeviceModel{}};
  EXPECT_FALSE(handle.has_operator());
  EXPECT_THROW(handle.begin_motion(), std::logic_error);
  EXPECT_THROW(handle.motion(), std::logic_error);
  handle.advance(1.0, 5.0, period);
  EXPECT_EQ(handle.activation(), 0.0);
  EXPECT_EQ(handle.hand_position(), 0.0);
}

// --- Contract.

TEST(CoupledHandle, ClipsAndCounts) {
  CoupledHandle handle{DeviceModel{}};
  handle.advance(3.3, 0.0, period);
  EXPECT_EQ(handle.clipped_samples(), 0u);
  handle.advance(-5.0, 0.0, period);
  EXPECT_EQ(handle.applied_force(), -3.3);
  handle.advance(3.4, 0.0, period);
  handle.advance(0.0, 0.0, period);
  EXPECT_EQ(handle.clipped_samples(), 2u);
  EXPECT_EQ(handle.clipped_share(), 0.5);
  CoupledHandle unclipped(bare(0.045, 0.05));
  unclipped.advance(1000.0, 0.0, period);
  EXPECT_EQ(unclipped.applied_force(), 1000.0);
  EXPECT_EQ(unclipped.clipped_share(), 0.0);
}

TEST(CoupledHandle, SameInputsGiveTheSameBits) {
  const auto run = [] {
    CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
    handle.begin_motion();
    std::vector<double> positions;
    for (int n = 0; n < 2000; ++n) {
      const double depth = -handle.position();
      handle.advance(depth > 0.0 ? 5500.0 * depth : 0.0, 0.3, period);
      positions.push_back(handle.position());
      positions.push_back(handle.velocity());
    }
    return positions;
  };
  EXPECT_EQ(run(), run());
}

TEST(CoupledHandle, RefusesWhatIsNotANumberOrNotAnInterval) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(handle.advance(nan, 0.0, period), std::invalid_argument);
  EXPECT_THROW(handle.advance(0.0, nan, period), std::invalid_argument);
  EXPECT_THROW(handle.advance(0.0, 0.0, nan), std::invalid_argument);
  EXPECT_THROW(handle.advance(0.0, 0.0, 0.0), std::invalid_argument);
  EXPECT_THROW(handle.advance(0.0, 0.0, -1e-3), std::invalid_argument);
  EXPECT_THROW(handle.advance(0.0, 0.0, 11.0), std::invalid_argument);
  EXPECT_THROW(handle.advance(std::numeric_limits<double>::infinity(), 0.0, period), std::invalid_argument);
  EXPECT_EQ(handle.samples(), 0u);
  EXPECT_THROW(CoupledHandle(bare(0.0, 1.0)), std::invalid_argument);
  EXPECT_THROW(CoupledHandle(DeviceModel{}, HandleStart{nan, 0.0}), std::invalid_argument);
}

TEST(CoupledHandle, ALongIntervalIsDividedIntoPieces) {
  CoupledHandle once(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  CoupledHandle often(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  once.begin_motion();
  often.begin_motion();
  once.advance(0.5, 1.0, 1.0);
  for (int n = 0; n < 500; ++n) often.advance(0.5, 1.0, 0.002);
  EXPECT_NEAR(once.position(), often.position(), 1e-12);
  EXPECT_NEAR(once.velocity(), often.velocity(), 1e-10);
}

}  // namespace
}  // namespace kmax::simulation::coupled_handle_test
