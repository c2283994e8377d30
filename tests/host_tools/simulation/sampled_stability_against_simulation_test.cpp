// The exact criterion of control/sampled_stability.hpp against a simulation that knows nothing of it
// (fate_at_wall.hpp). No friction, no quantization, no force limit. Just below the criterion's bound the
// motion must die away, just above it must grow. One test uses the simulated device's own delay.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "control/diolaiti_criterion.hpp"
#include "control/sampled_stability.hpp"
#include "tests/control/drawn_loop.hpp"
#include "tests/control/step_matrix.hpp"
#include "tests/host_tools/simulation/fate_at_wall.hpp"

namespace kmax::simulation::sampled_stability_against_simulation_test {

using Loop = control::SampledLoop<double>;

CoupledHandle handle_of(const Loop& loop, Delay delay) {
  const DeviceModel device{.mass = loop.mass,
                           .damping = loop.damping,
                           .friction = 0.0,
                           .force_limit = 0.0,
                           .delay = delay == Delay::of_the_device ? loop.delay : 0.0};
  const HandleStart start{.position = 0.0, .velocity = 0.1};
  if (loop.hand.hand_mass == 0.0) return CoupledHandle(device, start);
  const OperatorModel person{.grip_stiffness = loop.hand.grip_stiffness,
                             .grip_damping = loop.hand.grip_damping,
                             .hand_mass = loop.hand.hand_mass,
                             .arm_stiffness = loop.hand.arm_stiffness,
                             .arm_damping = loop.hand.arm_damping,
                             .activation_gain = 0.0};
  return CoupledHandle(device, person, IntendedMotionConfig{.start_position = 0.0}, start);
}

Fate fate_of(const Loop& loop, double stiffness, double samples_per_e_fold,
             Delay delay = Delay::divided_sample) {
  return fate_of(handle_of(loop, delay), loop, stiffness, samples_per_e_fold, delay);
}

double samples_per_e_fold(const Loop& loop, double stiffness) {
  return 1.0 / std::abs(std::log(control::radius_by_eigenvalues(loop, stiffness)));
}

// Whether the motion dies away by `share` of the limit below it, and grows by as much above.
void expect_limit(const Loop& loop, double limit, double share, Delay delay = Delay::divided_sample) {
  for (const double stiffness : {(1.0 - share) * limit, (1.0 + share) * limit})
    EXPECT_EQ(fate_of(loop, stiffness, samples_per_e_fold(loop, stiffness), delay),
              stiffness < limit ? Fate::decays : Fate::grows);
}

bool too_slow(const Loop& loop, double limit) {
  return std::max(samples_per_e_fold(loop, 0.99 * limit), samples_per_e_fold(loop, 1.01 * limit)) >
         longest_e_fold;
}

// m x'' + b x' = -K x_k under a zero-order hold; from the poles of the sampled system.
TEST(SampledStabilityAgainstSimulation, SevenKnownLimitsWithinAFiftiethOfAPercent) {
  constexpr double known[7][4] = {{2e-3, 0.045, 0.5, 501.9},    {2e-3, 0.045, 1.0, 1007.5},
                                  {2e-3, 0.045, 3.58, 3677.5},  {2e-3, 0.045, 8.41, 8967.3},
                                  {1e-3, 0.045, 0.5, 1001.9},   {0.5e-3, 0.045, 1.0, 4007.4},
                                  {0.1e-3, 0.045, 1.0, 20007.4}};
  for (const auto& [period, mass, damping, limit] : known) {
    SCOPED_TRACE(limit);
    const Loop loop{mass, damping, 0.0, period, 0.0, {}};
    EXPECT_NEAR(control::largest_stable_stiffness(loop), limit, 1e-3 * limit);
    expect_limit(loop, limit, 2e-4);
  }
}

TEST(SampledStabilityAgainstSimulation, ThousandLoopsWithinOnePercent) {
  control::LoopDraw draw(2009);
  int held = 0, delayed = 0, damped = 0;
  for (int cases = 0; cases < 1000;) {
    const Loop loop = draw.loop();
    const double limit = control::largest_stable_stiffness(loop);
    // Where 1 % of K changes too little it is not worth the samples.
    if (limit == 0.0 || too_slow(loop, limit)) continue;
    SCOPED_TRACE(++cases);
    expect_limit(loop, limit, 0.01);
    held += loop.hand.hand_mass > 0.0;
    delayed += loop.delay > 0.0;
    damped += loop.wall_damping != 0.0;
  }
  EXPECT_GT(held, 300);
  EXPECT_GT(delayed, 300);
  EXPECT_GT(damped, 300);
}

// The same with the delay that the simulated device has of its own.
TEST(SampledStabilityAgainstSimulation, DelayOfTheDeviceWithinOnePercent) {
  control::LoopDraw draw(2010);
  for (int cases = 0; cases < 100;) {
    const Loop loop = draw.loop();
    const double limit = control::largest_stable_stiffness(loop);
    if (limit == 0.0 || loop.delay == 0.0 || too_slow(loop, limit)) continue;
    SCOPED_TRACE(++cases);
    expect_limit(loop, limit, 0.01, Delay::of_the_device);
  }
}

// A loop that no stiffness makes stable, as the criterion says: more wall damping than the delay allows.
TEST(SampledStabilityAgainstSimulation, LoopsWithoutAnyStableStiffnessGrow) {
  control::LoopDraw draw(7);
  for (int cases = 0; cases < 100;) {
    Loop loop = draw.loop();
    loop.wall_damping = loop.damping * draw.uniform(2.0, 20.0);
    if (control::largest_stable_stiffness(loop) > 0.0) continue;
    const double stiffness = 10.0, slow = samples_per_e_fold(loop, stiffness);
    if (slow > longest_e_fold) continue;
    EXPECT_EQ(fate_of(loop, stiffness, slow), Fate::grows) << cases;
    ++cases;
  }
}

// Diolaiti's escape speed (control/diolaiti_criterion.hpp): with friction, the same wall beyond its linear
// limit comes to rest or runs away by how fast it starts. The balance is one of mean power: in an oscillation
// of peak speed V, friction takes f_c V 2/pi and viscous damping and the hold (b - K T/2) V^2/2, so the peak
// speed that escapes is 4/pi times v*.
TEST(SampledStabilityAgainstSimulation, EscapeSpeedWithFriction) {
  control::LoopDraw draw(8);
  for (int i = 0; i < 40; ++i) {
    const double mass = draw.log_uniform(0.02, 0.5), period = draw.log_uniform(1e-4, 1e-3);
    const double damping = mass * draw.log_uniform(0.5, 5.0), friction = draw.log_uniform(0.01, 0.3);
    const double stiffness = 2.0 * damping / period * draw.uniform(1.5, 3.0);
    const double escape = control::escape_speed(stiffness, damping, friction, period, 0.0);
    for (const double share : {0.9, 1.1}) {
      DeviceModel device{.mass = mass, .damping = damping, .friction = friction, .force_limit = 0.0};
      const double peak = share * 4.0 / 3.14159265 * escape;
      CoupledHandle handle(device, HandleStart{.position = 0.0, .velocity = peak});
      // Up to 100 times the turns in which the linear part alone would change the speed by e.
      bool rests = false, runs = false;
      for (long k = 0; k < 3'000'000 && !rests && !runs; ++k) {
        handle.advance(-stiffness * handle.position(), 0.0, period);
        runs = std::abs(handle.velocity()) > 2.0 * peak;
        rests = handle.sticking() && std::abs(stiffness * handle.position()) < friction;
      }
      EXPECT_EQ(rests, share < 1.0) << i;
      EXPECT_EQ(runs, share > 1.0) << i;
    }
  }
}

}  // namespace kmax::simulation::sampled_stability_against_simulation_test
