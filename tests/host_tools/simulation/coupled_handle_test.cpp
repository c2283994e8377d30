#include "host_tools/simulation/coupled_handle.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>

#include "host_tools/simulation/propagator_table.hpp"

namespace kmax::simulation::coupled_handle_test {

constexpr double period = 0.002;

DeviceModel bare(double mass, double damping, double friction = 0.0) {
  return {mass, damping, friction, 0.0};
}

DeviceModel bending(double stiffness = 2e4, double damping = 1.0) {
  return {.mass = 0.025, .structure = StructureModel{stiffness, damping, 0.02}};
}

// By a person whose motion has begun.
CoupledHandle held(const DeviceModel& device = {}, const IntendedMotionConfig& motion = {}) {
  CoupledHandle handle(device, OperatorModel{}, motion);
  handle.begin_motion();
  return handle;
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

TEST(CoupledHandle, WithoutFrictionItRestsButNeverSticks) {
  CoupledHandle handle(bare(0.045, 0.05), HandleStart{0.01, 0.0});
  handle.advance(0.0, 0.0, period);
  EXPECT_FALSE(handle.sticking());
  EXPECT_EQ(handle.position(), 0.01);
}

TEST(CoupledHandle, ThousandsOfBreakAwaysNeverMeetTheEventLimit) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  CoupledHandle handle = held({.friction = 0.3}, {.start_position = 10.0, .approach_speed = 0.01});
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

RC_GTEST_PROP(CoupledHandle, WithoutAPersonEnergyNeverExceedsTheWorkOfTheMotor, (bool structure)) {
  DeviceModel device = bare(0.045, *rc::gen::inRange(0, 20) * 0.1, *rc::gen::inRange(0, 50) * 0.01);
  if (structure)
    device.structure = bending(*rc::gen::inRange(1, 100) * 1e3, *rc::gen::inRange(0, 20) * 0.1).structure;
  CoupledHandle handle(device, HandleStart{0.0, *rc::gen::inRange(-10, 11) * 0.05});
  double energy = handle.energy();
  for (int n = 0; n < 50; ++n) {
    const double force = *rc::gen::inRange(-330, 331) * 0.01;
    const double before = handle.position();
    handle.advance(force, 0.0, period);
    RC_ASSERT(handle.energy() <= energy + force * (handle.position() - before) + 1e-12);
    energy = handle.energy();
  }
}

// --- Intervals.

TEST(CoupledHandle, DividingAnIntervalChangesNothingButRounding) {
  std::mt19937_64 random(7);
  struct Case {
    const char* name;
    double approach_speed, interval;
    int samples, parts;
    std::function<double()> force;
    double background, position_tolerance, velocity_tolerance;
    int least_stuck, most_stuck;
  };
  for (const Case& one : {Case{"a hand pulls a stuck handle until it slips", 0.01, period, 100, 40,
                               [] { return 0.0; }, 0.0, 1e-14, 1e-12, 6, 94},
                          Case{"forces to and fro", 0.2, period, 2000, 7,
                               [&] { return std::uniform_real_distribution<double>(-2.0, 2.0)(random); }, 0.0,
                               1e-12, 1e-10, 0, 2000},
                          Case{"an interval longer than the activation may be constant", 0.2, 1.0, 1, 500,
                               [] { return 0.5; }, 1.0, 1e-12, 1e-10, 0, 1}}) {
    SCOPED_TRACE(one.name);
    CoupledHandle coarse = held({}, {.approach_speed = one.approach_speed}), fine = coarse;
    int stuck = 0;
    for (int n = 0; n < one.samples; ++n) {
      const double force = one.force();
      coarse.advance(force, one.background, one.interval);
      for (int part = 0; part < one.parts; ++part)
        fine.advance(force, one.background, one.interval / one.parts);
      stuck += coarse.sticking() ? 1 : 0;
      ASSERT_NEAR(coarse.position(), fine.position(), one.position_tolerance) << n;
      ASSERT_NEAR(coarse.velocity(), fine.velocity(), one.velocity_tolerance) << n;
    }
    EXPECT_GE(stuck, one.least_stuck);
    EXPECT_LE(stuck, one.most_stuck);
  }
}

TEST(CoupledHandle, ConstantActivationPerIntervalIsASmallErrorAndShrinksQuadratically) {
  const auto run = [](double interval) {
    CoupledHandle handle = held(bare(0.045, 0.05), {.start_position = 0.0});
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
    const IntendedMotionConfig motion{
        .start_position = 0.003, .hold_time = 1000.0, .wall_position = 0.003, .wall_side = side};
    CoupledHandle handle = held({.friction = 100.0}, motion);  // it stays at the surface
    for (int n = 0; n < 10000; ++n) handle.advance(2.0 * side, 2.0, period);
    EXPECT_EQ(handle.position(), 0.003);
    EXPECT_NEAR(handle.gain(), 1.0 + 0.574 * 2.0, 1e-12);
    const double pressing =
        handle.gain() * OperatorModel{}.grip_stiffness * (handle.hand_position() - handle.position());
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

// A hand does not stiffen without end, and what acts across is not pressed against.
TEST(CoupledHandle, ActivationIsOfAllThatTheHandResistsUpToItsLimit) {
  const IntendedMotionConfig motion{.start_position = 0.0, .hold_time = 60.0};
  const auto pressing = [](const CoupledHandle& handle) {
    return handle.gain() * OperatorModel{}.grip_stiffness * (handle.position() - handle.hand_position());
  };
  struct Case {
    double along, across, activation;
  };
  for (const Case& one :
       {Case{9.0, 0.0, 7.0}, Case{1.2, -1.6, 2.0}, Case{0.0, 3.0, 3.0}, Case{1.0, 7.0, 7.0}}) {
    CoupledHandle handle = held({.friction = 100.0}, motion);
    handle.resist_across(one.across);
    for (int n = 0; n < 10000; ++n) handle.advance(0.0, one.along, period);
    EXPECT_NEAR(handle.activation(), one.activation, 1e-9);
    EXPECT_NEAR(handle.gain(), 1.0 + 0.574 * one.activation, 1e-9);
    EXPECT_NEAR(pressing(handle), motion.push_force + one.along, 1e-6);
    handle.resist_across(0.0);
    for (int n = 0; n < 10000; ++n) handle.advance(0.0, 0.0, period);
    EXPECT_NEAR(handle.activation(), 0.0, 1e-9) << "after it had arrived";
    EXPECT_THROW(handle.resist_across(std::nan("")), std::invalid_argument);
  }
}

TEST(CoupledHandle, MirroredSceneMovesMirrored) {
  CoupledHandle right = held(), left = held({}, {.start_position = -0.02, .wall_side = -1.0});
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

// --- A hand that lets go.

IntendedMotionConfig letting_go() {
  IntendedMotionConfig motion;
  motion.hold_time = 0.1;
  motion.open_time = 0.2;
  return motion;
}

// A wall of 1 N/mm without damping, sampled: it throws out what is let go in it.
double pushed_back(const CoupledHandle& handle) {
  return std::max(0.0, -1000.0 * handle.position());
}

TEST(CoupledHandle, AHandleThatIsLetGoMovesAsIfNobodyWereThere) {
  CoupledHandle handle = held({}, letting_go());
  while (!handle.let_go()) handle.advance(pushed_back(handle), 0.0, 50e-6);
  ASSERT_LT(handle.position(), 0.0) << "in the wall";
  ASSERT_NEAR(handle.motion().elapsed(), *handle.motion().hold_end(), 51e-6);
  EXPECT_TRUE(handle.has_operator());
  CoupledHandle alone(DeviceModel{}, HandleStart{handle.position(), handle.velocity()});
  for (int n = 0; n < 2000; ++n) {
    ASSERT_NEAR(handle.position(), alone.position(), 1e-12) << n;
    ASSERT_EQ(handle.hand_position(), handle.position());
    handle.advance(pushed_back(handle), 0.0, 50e-6);
    alone.advance(pushed_back(alone), 0.0, 50e-6);
  }
  EXPECT_GT(handle.position(), 0.0) << "thrown out";
}

TEST(CoupledHandle, TheHandTakesHoldAgainWhereTheHandleIsAndGoesBack) {
  CoupledHandle handle = held({}, letting_go());
  while (!handle.let_go()) handle.advance(pushed_back(handle), 0.0, period);
  int open = 0;
  double before = handle.position();
  for (; handle.let_go(); ++open) {
    before = handle.position();
    handle.advance(pushed_back(handle), 0.0, period);
  }
  EXPECT_EQ(open, 100);
  EXPECT_LT(std::abs(handle.position() - before), 1e-3) << "without a jump";
  for (int n = 0; n < 1000; ++n) handle.advance(pushed_back(handle), 0.0, period);
  EXPECT_NEAR(handle.position(), letting_go().start_position, 2e-3);
  // Told to begin while it is open, it takes hold at once.
  handle.begin_motion();
  while (!handle.let_go()) handle.advance(pushed_back(handle), 0.0, period);
  handle.begin_motion();
  EXPECT_FALSE(handle.let_go());
  handle.advance(0.0, 0.0, period);
  EXPECT_FALSE(handle.let_go());
}

TEST(CoupledHandle, LettingGoDoesNotDependOnHowManyIntervalsAreAskedForAtOnce) {
  CoupledHandle one = held({}, letting_go()), many = one;
  for (int n = 0; n < 400; ++n) {
    for (int i = 0; i < 10; ++i) one.advance(0.3, 0.0, 0.2 * period);
    many.advance(0.3, 0.0, 0.2 * period, 10);
    ASSERT_EQ(one.position(), many.position()) << n;
    ASSERT_EQ(one.let_go(), many.let_go());
  }
}

// --- Structure.

TEST(CoupledHandle, WithoutAStructureTheTipIsTheHandle) {
  CoupledHandle handle = held();
  for (int n = 0; n < 100; ++n) {
    handle.advance(0.1, 0.0, period);
    ASSERT_EQ(handle.tip_position(), handle.position());
    ASSERT_EQ(handle.tip_velocity(), handle.velocity());
  }
}

TEST(CoupledHandle, AStructureSwingsAtItsOwnFrequency) {
  // Two free masses: w^2 = k (1/m0 + 1/m1), and the centre of mass moves as one.
  DeviceModel device = bending(2e4, 0.0);
  device.damping = device.friction = device.force_limit = 0.0;
  CoupledHandle handle(device, HandleStart{0.0, 0.0});
  handle.advance(2.0, 0.0, 1e-3);
  const double momentum = 2.0 * 1e-3;
  const double w = std::sqrt(2e4 * (1.0 / 0.025 + 1.0 / 0.02));
  const double stretch = handle.tip_position() - handle.position();
  const double closing = handle.tip_velocity() - handle.velocity();
  for (int n = 1; n <= 200; ++n) {
    handle.advance(0.0, 0.0, 1e-4);
    const double t = n * 1e-4;
    ASSERT_NEAR(handle.tip_position() - handle.position(),
                stretch * std::cos(w * t) + closing / w * std::sin(w * t), 1e-15);
    ASSERT_NEAR(0.025 * handle.velocity() + 0.02 * handle.tip_velocity(), momentum, 1e-15);
  }
}

TEST(CoupledHandle, FrictionHoldsTheMotorsSideWhileTheTipGoesOn) {
  CoupledHandle handle(bending(2e4, 0.0), HandleStart{0.0, 0.0});
  handle.block(true);
  handle.advance(3.0, 0.0, period);
  EXPECT_TRUE(handle.sticking());
  EXPECT_EQ(handle.tip_position(), 0.0);
  handle.block(false);
  handle.advance(3.0, 0.0, 1e-3);
  handle.block(true);
  const double held_at = handle.position();
  double farthest = 0.0;
  for (int n = 0; n < 100; ++n) {
    handle.advance(0.0, 0.0, 1e-4);
    ASSERT_EQ(handle.position(), held_at);
    farthest = std::max(farthest, std::abs(handle.tip_position() - held_at));
  }
  EXPECT_GT(farthest, 1e-5);
}

TEST(CoupledHandle, ThePersonHoldsTheTip) {
  DeviceModel device = bending(3000.0, 0.5);
  device.friction = 100.0;  // the motor's side never moves
  const OperatorModel person;
  const IntendedMotionConfig motion{.start_position = 0.0, .hold_time = 1000.0};
  CoupledHandle handle = held(device, motion);
  for (int n = 0; n < 5000; ++n) handle.advance(0.0, 0.0, period);
  EXPECT_EQ(handle.position(), 0.0);
  // Structure, grip and arm in series to a target for 1 N through grip and arm.
  const double series = series_stiffness(person);
  const double force = (motion.push_force / series) / (1.0 / 3000.0 + 1.0 / series);
  EXPECT_NEAR(handle.tip_position(), -force / 3000.0, 1e-12);
  EXPECT_NEAR(person.grip_stiffness * (handle.hand_position() - handle.tip_position()), -force, 1e-9);
}

// --- Delay.

TEST(CoupledHandle, ADelayCountsAndClipsCommandsAndTellsTheForceThatActs) {
  CoupledHandle handle(DeviceModel{.delay = 0.003});
  handle.advance(5.0, 0.0, period);
  EXPECT_EQ(handle.clipped_samples(), 1u);
  EXPECT_EQ(handle.applied_force(), 0.0);
  handle.advance(1.0, 0.0, period);
  EXPECT_EQ(handle.applied_force(), 3.3);
  handle.advance(1.0, 0.0, period);
  EXPECT_EQ(handle.applied_force(), 1.0);
  EXPECT_EQ(handle.clipped_samples(), 1u);
}

// --- Integrators.

TEST(CoupledHandle, OtherIntegratorsComeNearTheExactOne) {
  for (const bool structure : {false, true}) {
    for (const double delay : {0.0, 0.0007}) {
      const auto run = [&](IntegratorKind kind) {
        DeviceModel device = structure ? bending() : DeviceModel{};
        device.delay = delay;
        CoupledHandle handle = held(device, {.start_position = 0.002});
        handle.set_integrator({.kind = kind, .substeps = kind == IntegratorKind::rk4 ? 400.0 : 4000.0});
        for (int n = 0; n < 60; ++n) handle.advance(n < 20 ? 0.0 : n % 8 < 4 ? 2.0 : -0.4, 0.5, period);
        return handle.position();
      };
      const double exact = run(IntegratorKind::exact);
      EXPECT_NEAR(run(IntegratorKind::adaptive), exact, 1e-9) << structure << delay;
      EXPECT_NEAR(run(IntegratorKind::rk4), exact, 1e-7) << structure << delay;
      EXPECT_NEAR(run(IntegratorKind::semi_implicit_euler), exact, 5e-5) << structure << delay;
      EXPECT_NE(run(IntegratorKind::rk4), exact);
    }
  }
}

TEST(CoupledHandle, ABlockedHandleStaysWhereItIsWhateverTheIntegrator) {
  for (const IntegratorKind kind : {IntegratorKind::exact, IntegratorKind::semi_implicit_euler,
                                    IntegratorKind::rk4, IntegratorKind::adaptive}) {
    DeviceModel device = bending();
    device.friction = 0.0;
    device.force_limit = 0.0;
    CoupledHandle handle = held(device);
    handle.set_integrator({.kind = kind});
    for (int n = 0; n < 20; ++n) handle.advance(0.0, 0.0, period);
    handle.block(true);
    const double place = handle.position();
    for (int n = 0; n < 20; ++n) handle.advance(1e4, 0.0, period);
    EXPECT_EQ(handle.position(), place);
    EXPECT_TRUE(handle.sticking());
    EXPECT_NE(handle.tip_position(), place);
    handle.block(false);
    handle.advance(1.0, 0.0, period);
    EXPECT_NE(handle.position(), place);
  }
}

TEST(CoupledHandle, TheMethodMayChangeUnderWay) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  CoupledHandle exact = handle;
  for (int n = 0; n < 40; ++n) {
    handle.set_integrator({.kind = n % 2 == 0 ? IntegratorKind::adaptive : IntegratorKind::exact});
    handle.advance(0.5, 0.0, period);
    exact.advance(0.5, 0.0, period);
  }
  EXPECT_NEAR(handle.position(), exact.position(), 1e-10);
  EXPECT_THROW(handle.set_integrator({.tolerance = 1.0}), std::invalid_argument);
}

// --- Whatever the parts are.

TEST(CoupledHandle, RefusesModelsThatCannotBe) {
  for (const double delay : {-1e-9, 1.1, std::nan("")})
    EXPECT_THROW(CoupledHandle{DeviceModel{.delay = delay}}, std::invalid_argument);
  for (const StructureModel& structure :
       {StructureModel{0.0, 1.0, 0.02}, StructureModel{2e4, -1.0, 0.02}, StructureModel{2e4, 1.0, 0.0},
        StructureModel{2e9, 1.0, 0.02}, StructureModel{2e4, std::nan(""), 0.02}})
    EXPECT_THROW(CoupledHandle{DeviceModel{.structure = structure}}, std::invalid_argument);
}

TEST(CoupledHandle, ACopyGoesItsOwnWay) {
  DeviceModel device = bending();
  device.delay = 0.0033;
  CoupledHandle one = held(device);
  one.share(std::make_shared<PropagatorTable>(device, OperatorModel{}));
  for (int n = 0; n < 50; ++n) one.advance(0.5, 1.0, period);
  CoupledHandle other = one;
  for (int n = 0; n < 50; ++n) {
    one.advance(0.2, 1.0, period);
    other.advance(0.2, 1.0, period);
    ASSERT_EQ(one.position(), other.position());
  }
  for (int n = 0; n < 50; ++n) one.advance(-1.0, 0.0, period);
  EXPECT_NE(one.position(), other.position());
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

TEST(CoupledHandle, RefusesWhatIsNotANumberOrNotAnInterval) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& [force, background, duration] : {std::array{nan, 0.0, period},
                                                    {0.0, nan, period},
                                                    {infinity, 0.0, period},
                                                    {0.0, 0.0, nan},
                                                    {0.0, 0.0, 0.0},
                                                    {0.0, 0.0, -1e-3},
                                                    {0.0, 0.0, 11.0}})
    EXPECT_THROW(handle.advance(force, background, duration), std::invalid_argument);
  EXPECT_EQ(handle.samples(), 0u);
  EXPECT_THROW(CoupledHandle(bare(0.0, 1.0)), std::invalid_argument);
  EXPECT_THROW(CoupledHandle(DeviceModel{}, HandleStart{nan, 0.0}), std::invalid_argument);
}

}  // namespace kmax::simulation::coupled_handle_test
