// The reference integrators, the equations that they share (chain_equations.hpp), their search for events,
// and what they refuse.
#include "host_tools/simulation/reference_integrators.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "host_tools/simulation/chain_equations.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulation::reference_integrators_test {

using host_tools_test::thrown_message;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

using Integrator = std::function<void(const ChainDynamics&, ChainState&, const ChainInput&, double duration)>;

Integrator euler(double step) {
  return [step](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_semi_implicit_euler(d, s, i, duration, step);
  };
}

Integrator rk4(double step) {
  return [step](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_rk4(d, s, i, duration, step);
  };
}

Integrator adaptive(double tolerance) {
  return [tolerance](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_adaptive(d, s, i, duration, tolerance);
  };
}

struct Named {
  const char* name;
  Integrator integrate;
  double error;  // m after a second, in these tests
};
const std::vector<Named>& all() {
  static const std::vector<Named> integrators{{"semi-implicit Euler", euler(1e-6), 2e-6},
                                              {"rk4", rk4(2e-6), 2e-10},
                                              {"adaptive", adaptive(1e-12), 1e-12}};
  return integrators;
}

ChainDynamics sliding_block(double mass, double friction) {
  return {.mass = {mass}, .friction = friction};
}

// The largest difference of position from the exact method over intervals of 2 ms with these forces, the
// person keeping to 0 and the handle pulled out of place at the start.
double error_against_exact(const DeviceModel& device, const OperatorModel& person,
                           const std::vector<double>& forces, const Integrator& integrate) {
  CoupledHandle exact(device, person, {.start_position = 0.0}, HandleStart{0.004, 0.05});
  const ChainDynamics chain = held_chain(device, &person, 1.0);
  ChainState state{.position = {0.004, 0.004, 0.0}, .velocity = {0.05, 0.0, 0.0}};
  double worst = 0.0;
  for (const double force : forces) {
    exact.advance(force, 0.0, 0.002);
    integrate(chain, state, {exact.applied_force(), 0.0, 0.0}, 0.002);
    worst = std::max({worst, std::abs(exact.position() - state.position[0]),
                      std::abs(exact.hand_position() - state.position[1])});
  }
  return worst;
}
std::vector<double> swinging_forces(double amplitude) {
  std::vector<double> forces;
  for (int n = 0; n < 250; ++n) forces.push_back(amplitude * std::sin(0.21 * n));
  return forces;
}

TEST(ReferenceIntegrators, ConvergeWithTheirOrderOnASmoothMotion) {
  const auto error = [](const Integrator& integrate) {
    return error_against_exact(DeviceModel{.friction = 0.0}, OperatorModel{}, swinging_forces(1.0),
                               integrate);
  };
  const double euler_ratio = error(euler(2e-5)) / error(euler(1e-5));
  EXPECT_NEAR(euler_ratio, 2.0, 0.1);
  const double rk4_ratio = error(rk4(5e-4)) / error(rk4(2.5e-4));
  EXPECT_NEAR(rk4_ratio, 16.0, 2.0);
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14})
    EXPECT_LT(error(adaptive(tolerance)), tolerance + 1e-15) << tolerance;
  EXPECT_GT(error(adaptive(1e-4)), 1e-10) << "the tolerance is not used";
}

TEST(ReferenceIntegrators, ConvergeThroughStopsSticksAndBreakAways) {
  const auto error = [&](const Integrator& integrate) {
    return error_against_exact(DeviceModel{}, OperatorModel{}, swinging_forces(0.4), integrate);
  };
  const double coarse = error(euler(1e-4)), fine = error(euler(1e-4 / 16));
  EXPECT_LT(coarse, 1e-3);
  EXPECT_LT(fine, coarse / 6.0);
  const double rk4_coarse = error(rk4(1e-4)), rk4_fine = error(rk4(1e-4 / 16));
  EXPECT_LT(rk4_coarse, coarse / 20.0);
  EXPECT_LT(rk4_fine, rk4_coarse / 30.0) << "order 2 at break-aways, 4 elsewhere";
  EXPECT_LT(error(adaptive(1e-4)), 1e-4);
  EXPECT_LT(error(adaptive(1e-8)), 1e-9);
  EXPECT_LT(error(adaptive(1e-13)), 1e-13);
}

TEST(ReferenceIntegrators, AgreeWithTheExactMethodWhereTheHandleTremblesAndInAGripOfAMegaNewtonPerMetre) {
  const DeviceModel rough{.mass = 0.02, .friction = 0.6}, gram{.mass = 1e-3};
  const OperatorModel springy{.grip_stiffness = 2000.0, .grip_damping = 0.1},
      firm{.grip_stiffness = 1e6, .grip_damping = 3.0};
  const auto swinging = swinging_forces(1.5);
  std::vector<double> jumping;
  for (int n = 0; n < 20; ++n) jumping.push_back(n % 3 == 0 ? 3.0 : -2.0);
  EXPECT_LT(error_against_exact(rough, springy, swinging, adaptive(1e-13)), 1e-12);
  EXPECT_LT(error_against_exact(rough, springy, swinging, rk4(1e-5)), 1e-6);
  EXPECT_LT(error_against_exact(rough, springy, swinging, euler(1e-6)), 2e-5);
  EXPECT_LT(error_against_exact(gram, firm, jumping, adaptive(1e-12)), 1e-12);
  EXPECT_LT(error_against_exact(gram, firm, jumping, rk4(2e-6)), 1e-8);
  EXPECT_LT(error_against_exact(gram, firm, jumping, euler(2e-7)), 1e-5);
}

TEST(ReferenceIntegrators, ABlockStopsWhereItsEnergyIsSpentAndStays) {
  for (const auto& [name, integrate, error] : all()) {
    ChainState state;
    state.velocity[0] = 0.2;
    integrate(sliding_block(0.045, 0.093), state, {}, 1.0);
    EXPECT_EQ(state.velocity[0], 0.0) << name;
    EXPECT_NEAR(state.position[0], 0.045 * 0.04 / (2 * 0.093), error) << name;
    const double stopped = state.position[0];
    for (const double force : {0.093, -0.093, 0.0, 0.0929}) {
      integrate(sliding_block(0.045, 0.093), state, {force, 0.0, 0.0}, 1.0);
      EXPECT_EQ(state.position[0], stopped) << name << ' ' << force;
      EXPECT_EQ(state.velocity[0], 0.0) << name;
    }
  }
}

TEST(ReferenceIntegrators, AForceAboveFrictionTurnsTheBlockRound) {
  // 1 N against 0.25 N, 0.1 kg at 0.5 m/s: 12.5 m/s^2 until rest after 0.04 s and 0.01 m, then -7.5 m/s^2.
  for (const auto& [name, integrate, error] : all()) {
    ChainState state;
    state.velocity[0] = 0.5;
    integrate(sliding_block(0.1, 0.25), state, {-1.0, 0.0, 0.0}, 0.1);
    EXPECT_NEAR(state.velocity[0], -0.45, 100 * error) << name;
    EXPECT_NEAR(state.position[0], 0.01 - 0.5 * 7.5 * 0.06 * 0.06, error) << name;
  }
  // In a single step: without springs Euler's velocities are exact.
  ChainState state;
  state.velocity[0] = 0.5;
  integrate_semi_implicit_euler(sliding_block(0.1, 0.25), state, {-1.0, 0.0, 0.0}, 0.1, 1.0);
  EXPECT_NEAR(state.velocity[0], -0.45, 1e-14);
}

// A spring whose far end moves: what pulls on the block changes steadily.
struct PulledBlock {
  ChainDynamics chain = sliding_block(0.05, 0.1);
  ChainState state;
  PulledBlock(double stiffness, double friction) {
    chain.stiffness[0] = stiffness;
    chain.friction = friction;
  }
  double position_after(const Integrator& integrate, const ChainInput& input, double duration) const {
    ChainState end = state;
    integrate(chain, end, input, duration);
    return end.position[0];
  }
};

TEST(ReferenceIntegrators, LeavesAndStopsWithinOneStep) {
  // 0.2 N falling by 100 N/s: away from 0.1 N at once, at rest after about 2 ms, 1.3 um further.
  const PulledBlock block(100.0, 0.1);
  const ChainInput input{0.0, 0.002, -1.0};
  const double truth = block.position_after(adaptive(1e-13), input, 0.0029);
  EXPECT_NEAR(truth, 1.33e-6, 2e-8);
  EXPECT_NEAR(block.position_after(rk4(1e-6), input, 0.0029), truth, 1e-11);
  EXPECT_NEAR(block.position_after(rk4(1.0), input, 0.0029), truth, 3e-9);
  EXPECT_NEAR(block.position_after(adaptive(1e-2), input, 0.0029), truth, 1e-9);
  // And before the first point that is looked at, an eighth of the step.
  const double pulled_back = block.position_after(adaptive(1e-13), input, 0.0175);
  EXPECT_LT(pulled_back, -5e-4);
  EXPECT_NEAR(block.position_after(adaptive(1e-2), input, 0.0175), pulled_back, 1e-5);
}

TEST(ReferenceIntegrators, AShortStopBetweenThePointsOfALongStepIsSeen) {
  // The velocity would dip to -4 um/s at 2.5 ms, for 0.4 ms; friction holds the block there instead.
  PulledBlock block(10.0, 0.01);
  block.state.velocity[0] = 6.21e-4;
  const ChainInput input{0.0, -1.5e-3, 1.0};
  const double truth = block.position_after(rk4(1e-7), input, 0.008);
  for (const double tolerance : {1e-2, 1e-6, 1e-12})
    EXPECT_NEAR(block.position_after(adaptive(tolerance), input, 0.008), truth, 1e-10) << tolerance;
  block.chain.friction = 0.0;
  EXPECT_GT(std::abs(block.position_after(adaptive(1e-12), input, 0.008) - truth), 1e-9)
      << "a check without use";
}

TEST(ReferenceIntegrators, AnEventOnTheEdgeOfAnIntervalIsNoEventTwice) {
  // Rest after exactly 0.25 s, in numbers without rounding; in eight intervals and in one.
  for (const auto& [name, integrate, error] : all()) {
    for (const double interval : {0.25, 0.03125}) {
      ChainState state;
      state.velocity[0] = 0.5;
      for (double t = 0.0; t < 0.25; t += interval) integrate(sliding_block(0.5, 1.0), state, {}, interval);
      EXPECT_NEAR(state.velocity[0], 0.0, 1e-14) << name;
      integrate(sliding_block(0.5, 1.0), state, {1.0, 0.0, 0.0}, 0.25);
      EXPECT_EQ(state.velocity[0], 0.0) << name;
      EXPECT_NEAR(state.position[0], 0.0625, error) << name;
    }
  }
}

TEST(ReferenceIntegrators, BreaksAwayWhenTheSpringPullsHarderThanFriction) {
  // k r t = f_c at t = 0.1 s; then x = r (t' - sin(w t') / w), w^2 = k / m.
  ChainDynamics chain = sliding_block(0.05, 0.1);
  chain.stiffness[0] = 100.0;
  const double omega = std::sqrt(100.0 / 0.05), since = 0.03;
  for (const auto& [name, integrate, error] : all()) {
    for (const double direction : {1.0, -1.0}) {
      ChainState state;
      integrate(chain, state, {0.0, 0.0, direction * 0.01}, 0.0999);
      EXPECT_EQ(state.position[0], 0.0) << name;
      state = {};
      integrate(chain, state, {0.0, 0.0, direction * 0.01}, 0.1 + since);
      EXPECT_NEAR(direction * state.position[0], 0.01 * (since - std::sin(omega * since) / omega), error)
          << name;
      EXPECT_NEAR(direction * state.velocity[0], 0.01 * (1.0 - std::cos(omega * since)), 1e3 * error) << name;
    }
  }
}

TEST(ReferenceIntegrators, ALosslessChainKeepsItsEnergy) {
  const ChainDynamics chain{.masses = 3, .mass = {0.045, 0.02, 0.234}, .stiffness = {3000.0, 540.0, 147.0}};
  const auto energy = [&](const ChainState& s) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double next = i == 2 ? 0.0 : s.position[i + 1];
      sum += 0.5 * chain.mass[i] * s.velocity[i] * s.velocity[i] +
             0.5 * chain.stiffness[i] * (next - s.position[i]) * (next - s.position[i]);
    }
    return sum;
  };
  const auto drift = [&](const Integrator& integrate) {
    ChainState state{.position = {0.001, -0.002, 0.003}};
    const double before = energy(state);
    for (int n = 0; n < 2000; ++n) integrate(chain, state, {}, 0.002);
    return energy(state) / before - 1.0;
  };
  EXPECT_LT(std::abs(drift(euler(1e-5))), 1e-2) << "bounded: it is symplectic";
  const double rk4_drift = drift(rk4(1e-4));
  EXPECT_LT(rk4_drift, 0.0) << "RK4 damps";
  EXPECT_GT(rk4_drift, -1e-3);
  EXPECT_LT(std::abs(drift(adaptive(1e-12))), 1e-9);
}

TEST(ReferenceIntegrators, FrictionNeverGivesEnergy) {
  const OperatorModel person;
  const ChainDynamics chain = held_chain(DeviceModel{}, &person, 1.0);
  const auto energy = [&](const ChainState& s) {
    const double grip = s.position[1] - s.position[0];
    return 0.5 *
           (chain.mass[0] * s.velocity[0] * s.velocity[0] + chain.mass[1] * s.velocity[1] * s.velocity[1] +
            chain.stiffness[0] * grip * grip + chain.stiffness[1] * s.position[1] * s.position[1]);
  };
  for (const auto& [name, integrate, error] : all()) {
    ChainState state{.position = {0.01, -0.01, 0.0}};
    double before = energy(state);
    const double first = before;
    for (int n = 0; n < 500; ++n) {
      integrate(chain, state, {}, 0.002);
      EXPECT_LE(energy(state), before * (1.0 + 1e-6) + 1e-15) << name << ' ' << n;
      before = energy(state);
    }
    EXPECT_LT(before, 0.1 * first) << name;
    EXPECT_EQ(state.velocity[0], 0.0) << name;
  }
}

TEST(ReferenceIntegrators, MassesThatAreNotThereAreNotRead) {
  for (const auto& [name, integrate, error] : all()) {
    ChainDynamics chain = sliding_block(0.1, 0.0);
    ChainState plain, spoilt;
    ChainDynamics other = chain;
    for (std::size_t i = 1; i < 3; ++i)
      other.mass[i] = other.stiffness[i] = other.damping[i] = spoilt.position[i] = spoilt.velocity[i] = nan;
    integrate(chain, plain, {1.0, 0.0, 0.0}, 0.01);
    integrate(other, spoilt, {1.0, 0.0, 0.0}, 0.01);
    EXPECT_EQ(plain.position[0], spoilt.position[0]) << name;
    EXPECT_NEAR(plain.position[0], 0.5 * 10.0 * 1e-4, error) << name;
  }
}

TEST(ReferenceIntegrators, AGrazingSpringDoesNotHang) {
  // The spring's pull rises to exactly the friction force and falls again; with the limit met within
  // rounding.
  ChainDynamics chain{.masses = 2, .mass = {0.05, 0.2}, .stiffness = {100.0, 50.0}};
  const double amplitude = 0.001;
  for (const double excess : {-1e-12, -1e-15, 0.0, 1e-15, 1e-12}) {
    chain.friction = 100.0 * amplitude * (1.0 + excess);
    for (const auto& [name, integrate, error] : all()) {
      ChainState state{.position = {0.0, amplitude, 0.0}};
      for (int n = 0; n < 100; ++n) integrate(chain, state, {}, 0.01);
      EXPECT_LT(std::abs(state.position[0]), 1e-9) << name << ' ' << excess;
    }
  }
}

RC_GTEST_PROP(ReferenceIntegrators, AdaptiveAgreesWithTheExactMethodForAnyParameters, ()) {
  const auto between = [](double low, double high) {
    return low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0);
  };
  const DeviceModel device{
      .mass = between(1e-3, 0.5), .damping = between(1e-3, 2.0), .friction = between(1e-3, 1.0)};
  const OperatorModel person{.grip_stiffness = between(50.0, 5e4),
                             .grip_damping = between(1e-2, 10.0),
                             .hand_mass = between(0.02, 1.0),
                             .arm_stiffness = between(20.0, 1000.0),
                             .arm_damping = between(0.1, 30.0)};
  std::vector<double> forces;
  for (int n = 0; n < 10; ++n) forces.push_back(*rc::gen::inRange(-400, 401) * 0.01);
  RC_ASSERT(error_against_exact(device, person, forces, adaptive(1e-12)) < 1e-11);
}

TEST(ChainEquations, ForcesAreThoseOfTheDrawing) {
  const ChainDynamics chain{.masses = 3,
                            .mass = {2.0, 4.0, 8.0},
                            .stiffness = {10.0, 20.0, 30.0},
                            .damping = {1.0, 2.0, 3.0},
                            .base_damping = 0.5,
                            .friction = 0.25};
  const ChainInput input{7.0, 1.0, 0.5};
  const ChainEquations<3> equations(chain, input);
  const ChainEquations<3>::Vector s{0.1, 0.3, 0.6, 1.0, 2.0, 4.0};
  const auto force = equations.forces(s, 2.0);
  const double first = 10.0 * 0.2 + 1.0 * 1.0, second = 20.0 * 0.3 + 2.0 * 2.0;
  const double last = 30.0 * (1.0 + 0.5 * 2.0 - 0.6) + 3.0 * (0.5 - 4.0);
  EXPECT_NEAR(force[0], 7.0 - 0.5 * 1.0 + first, 1e-14);
  EXPECT_NEAR(force[1], second - first, 1e-14);
  EXPECT_NEAR(force[2], last - second, 1e-14);

  const auto forwards = equations.derivative(s, 2.0, Contact::forwards);
  EXPECT_EQ(forwards[0], 1.0);
  EXPECT_EQ(forwards[2], 4.0);
  EXPECT_NEAR(forwards[3], (force[0] - 0.25) / 2.0, 1e-14);
  EXPECT_NEAR(equations.derivative(s, 2.0, Contact::backwards)[3], (force[0] + 0.25) / 2.0, 1e-14);
  EXPECT_NEAR(forwards[4], force[1] / 4.0, 1e-14);
  const auto stuck = equations.derivative(s, 2.0, Contact::sticking);
  EXPECT_EQ(stuck[0], 0.0);
  EXPECT_EQ(stuck[3], 0.0);
  EXPECT_EQ(stuck[4], forwards[4]);
}

TEST(ChainEquations, FrictionHoldsUpToItsForceAndNotWithoutFriction) {
  ChainDynamics chain = sliding_block(1.0, 0.25);
  const auto contact = [&](double force, double velocity) {
    const ChainInput input{force, 0.0, 0.0};
    return ChainEquations<1>(chain, input).contact({0.0, velocity}, 0.0);
  };
  EXPECT_EQ(contact(0.25, 0.0), Contact::sticking);
  EXPECT_EQ(contact(-0.25, 0.0), Contact::sticking);
  EXPECT_EQ(contact(0.2500001, 0.0), Contact::forwards);
  EXPECT_EQ(contact(-0.2500001, 0.0), Contact::backwards);
  EXPECT_EQ(contact(-5.0, 1e-300), Contact::forwards) << "it still moves";
  EXPECT_EQ(contact(5.0, -1e-300), Contact::backwards);
  chain.friction = 0.0;
  EXPECT_NE(contact(0.0, 0.0), Contact::sticking);
}

TEST(ChainEquations, StateAndVectorAreTheSameNumbers) {
  ChainState state{{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}};
  EXPECT_EQ((ChainEquations<2>::vector_of(state)), (std::array{1.0, 2.0, 4.0, 5.0}));
  ChainEquations<2>::store({10.0, 20.0, 40.0, 50.0}, state);
  EXPECT_EQ(state.position, (std::array{10.0, 20.0, 3.0}));
  EXPECT_EQ(state.velocity, (std::array{40.0, 50.0, 6.0}));
  thrown_message<std::runtime_error>([&] { ChainEquations<1>::store({0.0, nan}, state); });
  EXPECT_EQ(state.position[0], 10.0);
}

TEST(ChainEquations, StepsAreEqualAndNoLongerThanAsked) {
  EXPECT_EQ(equal_steps(0.002, 0.002), 1);
  EXPECT_EQ(equal_steps(0.002, 1.0), 1);
  EXPECT_EQ(equal_steps(0.002, 0.0002), 10) << "ten times a rounded tenth is ten";
  EXPECT_EQ(equal_steps(0.002, 0.0019), 2);
  EXPECT_EQ(equal_steps(0.002, 0.002 / 3.0), 3);
  EXPECT_EQ(equal_steps(10.0, 1.1e-8), 909090910);
}

TEST(EventSearch, FindsTheZeroOfSmoothAndOfBentFunctions) {
  EXPECT_NEAR(falling_zero_of([](double t) { return 1.0 - t; }, 0.0, 3.0), 1.0, 1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return std::cos(t); }, 0.0, 3.0), std::acos(0.0), 1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return 1e-30 * (0.3 - t * t * t); }, 0.0, 1.0), std::cbrt(0.3),
              1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return t < 0.7 ? 1.0 : 0.7 - t - 1e-9; }, 0.0, 1.0), 0.7, 1e-12);
  EXPECT_NEAR(falling_zero_of([](double t) { return std::exp(-50.0 * t) - 1e-20; }, 0.0, 1.0),
              20.0 * std::log(10.0) / 50.0, 1e-9);
}

TEST(EventSearch, TheEventHasHappenedWhereItEnds) {
  for (int n = 1; n < 200; ++n) {
    const double zero = 0.005 * n;
    const auto value = [zero](double t) { return std::sin(zero - t); };
    EXPECT_LE(value(falling_zero_of(value, 0.0, 1.0)), 0.0) << zero;
  }
}

TEST(EventSearch, EndsThatAreNoBracketAreAnswered) {
  const auto falling = [](double t) { return 0.5 - t; };
  EXPECT_EQ(falling_zero_of(falling, 0.5, 1.0), 0.5) << "nothing above zero: at once";
  EXPECT_EQ(falling_zero_of(falling, 0.6, 1.0), 0.6);
  EXPECT_EQ(falling_zero_of(falling, 0.0, 0.5), 0.5) << "zero at the end itself";
  EXPECT_EQ(falling_zero_of(falling, 0.0, 0.4), 0.4) << "rounding left nothing below zero: at the end";
}

TEST(EventSearch, AStartFromZeroIsFollowedUntilItMoves) {
  // t (a - t): moving forwards until a.
  for (const double zero : {0.6, 0.3, 1e-3, 1e-9}) {
    const auto value = [zero](double t) { return t * (zero - t); };
    const double moving = moving_start(value, 1.0);
    EXPECT_GT(moving, 0.0);
    EXPECT_GT(value(moving), 0.0);
    EXPECT_NEAR(falling_zero_of(value, moving, 1.0), zero, 1e-12 * zero + 1e-15);
  }
  EXPECT_EQ(moving_start([](double t) { return -t; }, 1.0), -1.0);
}

TEST(ReferenceIntegratorsRefuse, WhatCannotBeAndLeaveTheStateAlone) {
  struct Case {
    const char* message;
    std::function<void(ChainDynamics&, ChainState&, ChainInput&, double& duration)> spoil;
  };
  const std::vector<Case> cases{
      {"chain of 0 masses: allowed are 1 to 3", [](auto& d, auto&, auto&, double&) { d.masses = 0; }},
      {"chain of 4 masses", [](auto& d, auto&, auto&, double&) { d.masses = 4; }},
      {"chain mass = 0: allowed is", [](auto& d, auto&, auto&, double&) { d.mass[1] = 0.0; }},
      {"chain mass = -1", [](auto& d, auto&, auto&, double&) { d.mass[0] = -1.0; }},
      {"chain mass = nan", [](auto& d, auto&, auto&, double&) { d.mass[1] = nan; }},
      {"chain mass = 1e-310", [](auto& d, auto&, auto&, double&) { d.mass[1] = 1e-310; }},
      {"chain stiffness = -1", [](auto& d, auto&, auto&, double&) { d.stiffness[0] = -1.0; }},
      {"chain stiffness = inf", [](auto& d, auto&, auto&, double&) { d.stiffness[1] = infinity; }},
      {"chain damping = nan", [](auto& d, auto&, auto&, double&) { d.damping[1] = nan; }},
      {"chain base damping = -0.1", [](auto& d, auto&, auto&, double&) { d.base_damping = -0.1; }},
      {"chain friction = -0.1", [](auto& d, auto&, auto&, double&) { d.friction = -0.1; }},
      {"chain friction = inf", [](auto& d, auto&, auto&, double&) { d.friction = infinity; }},
      {"chain position = nan", [](auto&, auto& s, auto&, double&) { s.position[1] = nan; }},
      {"chain velocity = inf", [](auto&, auto& s, auto&, double&) { s.velocity[0] = infinity; }},
      {"chain force = nan", [](auto&, auto&, auto& i, double&) { i.force = nan; }},
      {"intended position = inf", [](auto&, auto&, auto& i, double&) { i.intended = infinity; }},
      {"intended rate = nan", [](auto&, auto&, auto& i, double&) { i.intended_rate = nan; }},
      {"duration = 0", [](auto&, auto&, auto&, double& t) { t = 0.0; }},
      {"duration = -0.002", [](auto&, auto&, auto&, double& t) { t = -0.002; }},
      {"duration = 10.1", [](auto&, auto&, auto&, double& t) { t = 10.1; }},
      {"duration = nan", [](auto&, auto&, auto&, double& t) { t = nan; }},
  };
  for (const auto& [name, integrate, error] : all()) {
    for (const Case& bad : cases) {
      const OperatorModel person;
      ChainDynamics chain = held_chain(DeviceModel{}, &person, 1.0);
      ChainState state{.position = {0.1, 0.2, 0.3}};
      ChainInput input;
      double duration = 0.002;
      bad.spoil(chain, state, input, duration);
      const auto before = std::bit_cast<std::array<std::uint64_t, 6>>(state);
      EXPECT_CONTAINS(thrown_message<std::invalid_argument>(
                          [&, &run = integrate] { run(chain, state, input, duration); }),
                      bad.message);
      EXPECT_EQ((std::bit_cast<std::array<std::uint64_t, 6>>(state)), before) << name;
    }
  }
}

TEST(ReferenceIntegratorsRefuse, StepsAndTolerancesOutOfRange) {
  const ChainDynamics chain = sliding_block(1.0, 0.0);
  ChainState state;
  for (const double step : {0.0, -1.0, 1e-13, nan, infinity}) {
    for (const Integrator& integrate : {euler(step), rk4(step)})
      EXPECT_CONTAINS(thrown_message<std::invalid_argument>([&] { integrate(chain, state, {}, 0.002); }),
                      "step = ");
  }
  for (const double tolerance : {0.0, -1e-6, 0.99e-14, 0.011, nan}) {
    EXPECT_CONTAINS(thrown_message<std::invalid_argument>(
                        [&] { integrate_adaptive(chain, state, {}, 0.002, tolerance); }),
                    "allowed is a number from 1e-14 to 0.01");
  }
}

TEST(ReferenceIntegratorsRefuse, StepsThatAreTooLongInWordsAndNotInNumbers) {
  ChainDynamics chain = sliding_block(1e-3, 0.0);
  chain.stiffness[0] = 1e6;
  for (const Integrator& integrate : {euler(0.002), rk4(0.002)}) {
    ChainState state;
    state.position[0] = 1.0;
    EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { integrate(chain, state, {}, 10.0); }),
                    "the step is too long");
    EXPECT_EQ(state.position[0], 1.0);
  }
  chain.stiffness[0] = 1e18;
  ChainState state;
  state.position[0] = 1.0;
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { integrate_adaptive(chain, state, {}, 10.0, 1e-6); }),
      "choose a larger");
  EXPECT_EQ(state.position[0], 1.0);
}

}  // namespace kmax::simulation::reference_integrators_test
