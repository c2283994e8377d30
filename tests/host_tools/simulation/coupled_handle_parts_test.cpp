// The parts that a scene may add to a handle - structure, delay, another integrator - and what holds whatever
// they are.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/host_tools/simulation/drawn_models.hpp"

namespace kmax::simulation::coupled_handle_parts_test {
namespace {

constexpr double period = 0.002;

DeviceModel bending(double stiffness = 2e4, double damping = 1.0) {
  DeviceModel device;
  device.mass = 0.025;
  device.structure = StructureModel{stiffness, damping, 0.02};
  return device;
}

// --- Structure.

TEST(CoupledHandleParts, WithoutAStructureTheTipIsTheHandle) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  handle.begin_motion();
  for (int n = 0; n < 100; ++n) {
    handle.advance(0.1, 0.0, period);
    ASSERT_EQ(handle.tip_position(), handle.position());
    ASSERT_EQ(handle.tip_velocity(), handle.velocity());
  }
}

TEST(CoupledHandleParts, AStructureSwingsAtItsOwnFrequency) {
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

TEST(CoupledHandleParts, AVeryStiffStructureIsARigidDevice) {
  IntendedMotionConfig motion;
  motion.start_position = 0.004;
  CoupledHandle rigid(DeviceModel{}, OperatorModel{}, motion);
  CoupledHandle stiff(bending(1e8, 100.0), OperatorModel{}, motion);
  rigid.begin_motion();
  stiff.begin_motion();
  for (int n = 0; n < 100; ++n) {
    const double force = std::max(0.0, -2000.0 * rigid.position());
    rigid.advance(force, 0.0, period);
    stiff.advance(force, 0.0, period);
    ASSERT_NEAR(stiff.position(), rigid.position(), 2e-6) << n;
    ASSERT_NEAR(stiff.tip_position(), rigid.position(), 2e-6) << n;
  }
}

TEST(CoupledHandleParts, FrictionHoldsTheMotorsSideWhileTheTipGoesOn) {
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

TEST(CoupledHandleParts, ThePersonHoldsTheTip) {
  DeviceModel device = bending(3000.0, 0.5);
  device.friction = 100.0;  // the motor's side never moves
  OperatorModel person;
  IntendedMotionConfig motion;
  motion.start_position = 0.0;
  motion.hold_time = 1000.0;
  CoupledHandle handle(device, person, motion);
  handle.begin_motion();
  for (int n = 0; n < 5000; ++n) handle.advance(0.0, 0.0, period);
  EXPECT_EQ(handle.position(), 0.0);
  // Structure, grip and arm in series to a target for 1 N through grip and arm.
  const double series = series_stiffness(person);
  const double force = (motion.push_force / series) / (1.0 / 3000.0 + 1.0 / series);
  EXPECT_NEAR(handle.tip_position(), -force / 3000.0, 1e-12);
  EXPECT_NEAR(person.grip_stiffness * (handle.hand_position() - handle.tip_position()), -force, 1e-9);
}

// --- Delay.

TEST(CoupledHandleParts, ADelayedForceIsTheSameForceLater) {
  DeviceModel late;
  late.delay = 0.0045;
  CoupledHandle delayed(late);
  CoupledHandle direct{DeviceModel{}};
  direct.advance(0.0, 0.0, 0.0045);
  for (int n = 0; n < 50; ++n) {
    delayed.advance(n % 7 < 3 ? 1.0 : -0.8, 0.0, period);
    EXPECT_EQ(delayed.samples(), static_cast<std::uint64_t>(n + 1));
  }
  // Let the last commands arrive, no longer.
  delayed.advance(0.0, 0.0, 0.0045);
  for (int n = 0; n < 50; ++n) direct.advance(n % 7 < 3 ? 1.0 : -0.8, 0.0, period);
  EXPECT_NEAR(delayed.position(), direct.position(), 1e-15);
  EXPECT_NEAR(delayed.velocity(), direct.velocity(), 1e-13);
}

TEST(CoupledHandleParts, ADelayCountsAndClipsCommandsAndTellsTheForceThatActs) {
  DeviceModel late;
  late.delay = 0.003;
  CoupledHandle handle(late);
  handle.advance(5.0, 0.0, period);
  EXPECT_EQ(handle.clipped_samples(), 1u);
  EXPECT_EQ(handle.applied_force(), 0.0);
  handle.advance(1.0, 0.0, period);
  EXPECT_EQ(handle.applied_force(), 3.3);
  handle.advance(1.0, 0.0, period);
  EXPECT_EQ(handle.applied_force(), 1.0);
  EXPECT_EQ(handle.clipped_samples(), 1u);
}

TEST(CoupledHandleParts, TheBackgroundForceIsNotDelayed) {
  DeviceModel late;
  late.delay = 0.5;
  CoupledHandle delayed(late, OperatorModel{}, IntendedMotionConfig{});
  CoupledHandle direct(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  for (int n = 0; n < 100; ++n) {
    delayed.advance(0.0, 2.0, period);
    direct.advance(0.0, 2.0, period);
  }
  EXPECT_EQ(delayed.activation(), direct.activation());
}

// --- Integrators.

TEST(CoupledHandleParts, OtherIntegratorsComeNearTheExactOne) {
  for (const bool structure : {false, true}) {
    for (const double delay : {0.0, 0.0007}) {
      const auto run = [&](IntegratorKind kind) {
        DeviceModel device = structure ? bending() : DeviceModel{};
        device.delay = delay;
        IntendedMotionConfig motion;
        motion.start_position = 0.002;
        CoupledHandle handle(device, OperatorModel{}, motion);
        IntegratorConfig config;
        config.kind = kind;
        config.substeps = kind == IntegratorKind::rk4 ? 400.0 : 4000.0;
        handle.set_integrator(config);
        handle.begin_motion();
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

TEST(CoupledHandleParts, ABlockedHandleStaysWhereItIsWhateverTheIntegrator) {
  for (const IntegratorKind kind : {IntegratorKind::exact, IntegratorKind::semi_implicit_euler,
                                    IntegratorKind::rk4, IntegratorKind::adaptive}) {
    DeviceModel device = bending();
    device.friction = 0.0;
    device.force_limit = 0.0;
    CoupledHandle handle(device, OperatorModel{}, IntendedMotionConfig{});
    IntegratorConfig config;
    config.kind = kind;
    handle.set_integrator(config);
    handle.begin_motion();
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

TEST(CoupledHandleParts, TheMethodMayChangeUnderWay) {
  CoupledHandle handle(DeviceModel{}, OperatorModel{}, IntendedMotionConfig{});
  CoupledHandle exact = handle;
  IntegratorConfig config;
  config.kind = IntegratorKind::adaptive;
  for (int n = 0; n < 40; ++n) {
    handle.set_integrator(n % 2 == 0 ? config : IntegratorConfig{});
    handle.advance(0.5, 0.0, period);
    exact.advance(0.5, 0.0, period);
  }
  EXPECT_NEAR(handle.position(), exact.position(), 1e-10);
  config.tolerance = 1.0;
  EXPECT_THROW(handle.set_integrator(config), std::invalid_argument);
}

// --- Whatever the parts are.

TEST(CoupledHandleParts, RefusesModelsThatCannotBe) {
  DeviceModel device;
  device.delay = -1e-9;
  EXPECT_THROW(CoupledHandle{device}, std::invalid_argument);
  device.delay = 1.1;
  EXPECT_THROW(CoupledHandle{device}, std::invalid_argument);
  device.delay = std::nan("");
  EXPECT_THROW(CoupledHandle{device}, std::invalid_argument);
  for (const StructureModel& structure :
       {StructureModel{0.0, 1.0, 0.02}, StructureModel{2e4, -1.0, 0.02}, StructureModel{2e4, 1.0, 0.0},
        StructureModel{2e9, 1.0, 0.02}, StructureModel{2e4, std::nan(""), 0.02}}) {
    device = DeviceModel{};
    device.structure = structure;
    EXPECT_THROW(CoupledHandle{device}, std::invalid_argument);
  }
}

TEST(CoupledHandleParts, ACopyGoesItsOwnWay) {
  DeviceModel device = bending();
  device.delay = 0.0033;
  CoupledHandle one(device, OperatorModel{}, IntendedMotionConfig{});
  one.share(std::make_shared<PropagatorTable>(device, OperatorModel{}));
  one.begin_motion();
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

RC_GTEST_PROP(CoupledHandleParts, DissipationOnlyTakesEnergy, ()) {
  DeviceModel device = bending(*rc::gen::inRange(1, 100) * 1e3, *rc::gen::inRange(0, 20) * 0.1);
  device.friction = *rc::gen::inRange(0, 10) * 0.05;
  CoupledHandle handle(device, HandleStart{0.0, *rc::gen::inRange(-10, 11) * 0.05});
  require_no_energy_from_nowhere(handle, 40, period);
}

}  // namespace
}  // namespace kmax::simulation::coupled_handle_parts_test
