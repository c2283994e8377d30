// The bound of a loop with a structure against motions of a simulated handle that bends
// (host_tools/simulation/coupled_handle.hpp), which knows neither polynomials nor eigenvalues: 3 % below the
// motion must die away, 3 % above it must grow.

#include <gtest/gtest.h>

#include "tests/host_tools/check/drawn_bent_loop.hpp"
#include "tests/host_tools/simulation/fate_at_wall.hpp"

namespace kmax::check::bent_loop_against_simulation_test {

using simulation::CoupledHandle;
using simulation::Delay;
using simulation::Fate;

CoupledHandle handle_of(const BentLoop& loop, Delay delay) {
  const auto& motor = loop.motor_side;
  const simulation::DeviceModel device{.mass = motor.mass,
                                       .damping = motor.damping,
                                       .friction = 0.0,
                                       .force_limit = 0.0,
                                       .delay = delay == Delay::of_the_device ? motor.delay : 0.0,
                                       .structure = loop.structure};
  const simulation::HandleStart start{.position = 0.0, .velocity = 0.1};
  if (motor.hand.hand_mass == 0.0) return CoupledHandle(device, start);
  const simulation::OperatorModel person{.grip_stiffness = motor.hand.grip_stiffness,
                                         .grip_damping = motor.hand.grip_damping,
                                         .hand_mass = motor.hand.hand_mass,
                                         .arm_stiffness = motor.hand.arm_stiffness,
                                         .arm_damping = motor.hand.arm_damping,
                                         .activation_gain = 0.0};
  return CoupledHandle(device, person, simulation::IntendedMotionConfig{.start_position = 0.0}, start);
}

double samples_per_e_fold(const BentLoop& loop, double stiffness) {
  return 1.0 / std::abs(std::log(radius_by_eigenvalues(loop, stiffness)));
}

/// False, and nothing is expected, of a loop whose motion changes too slowly to be worth the samples.
bool expect_limit(const BentLoop& loop, Delay delay) {
  const double limit = largest_stable_stiffness(loop);
  if (limit == 0.0) return false;
  constexpr double longest = 0.2 * simulation::longest_e_fold;
  const double below = samples_per_e_fold(loop, 0.97 * limit), above = samples_per_e_fold(loop, 1.03 * limit);
  if (std::max(below, above) > longest) return false;
  const auto fate = [&](double stiffness, double slowness) {
    constexpr int settling = 8;
    return fate_of(handle_of(loop, delay), loop.motor_side, stiffness, slowness, delay, settling);
  };
  EXPECT_EQ(fate(0.97 * limit, below), Fate::decays);
  EXPECT_EQ(fate(1.03 * limit, above), Fate::grows);
  return true;
}

TEST(BentLoopAgainstSimulation, DrawnLoopsWithinThreePercent) {
  control::LoopDraw draw(41);
  int held = 0, delayed = 0, damped = 0, soft = 0;
  for (int cases = 0; cases < 300;) {
    const BentLoop loop = drawn_bent_loop(draw);
    SCOPED_TRACE(cases);
    if (!expect_limit(loop, Delay::divided_sample)) continue;
    ++cases;
    held += loop.motor_side.hand.hand_mass > 0.0;
    delayed += loop.motor_side.delay > 0.0;
    damped += loop.motor_side.wall_damping != 0.0;
    soft += loop.structure.stiffness < largest_stable_stiffness(loop);
  }
  EXPECT_GT(held, 80);
  EXPECT_GT(delayed, 80);
  EXPECT_GT(damped, 80);
  EXPECT_GT(soft, 40);
}

// With the delay that the simulated device has of its own.
TEST(BentLoopAgainstSimulation, DelayOfTheDeviceWithinThreePercent) {
  control::LoopDraw draw(42);
  for (int cases = 0; cases < 40;) {
    const BentLoop loop = drawn_bent_loop(draw);
    if (loop.motor_side.delay == 0.0) continue;
    SCOPED_TRACE(cases);
    if (expect_limit(loop, Delay::of_the_device)) ++cases;
  }
}

// Masses, stiffnesses and delays of desktop devices in turn, at the papers' 500 Hz and at 2 kHz.
TEST(BentLoopAgainstSimulation, AGridOfDesktopDevicesWithinThreePercent) {
  int judged = 0;
  for (const double period : {2e-3, 0.5e-3}) {
    for (const double handle_mass : {0.002, 0.02, 0.08}) {
      for (const double stiffness : {1020.0, 2310.0, 20'000.0}) {
        for (const double delay : {0.0, 0.3, 1.0, 2.5}) {
          for (const bool held : {false, true}) {
            BentLoop loop{{0.025, 0.4, 0.0, period, delay * period, {}}, {stiffness, 1.0, handle_mass}};
            if (held) loop.motor_side.hand = {0.234, 540, 1.7, 147, 9.1};
            SCOPED_TRACE(testing::Message()
                         << period << ' ' << handle_mass << ' ' << stiffness << ' ' << delay << ' ' << held);
            judged += expect_limit(loop, Delay::divided_sample);
          }
        }
      }
    }
  }
  EXPECT_GT(judged, 120);
}

}  // namespace kmax::check::bent_loop_against_simulation_test
