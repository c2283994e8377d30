// The equations that the reference integrators share, their search for events, and what they refuse.
#include "host_tools/simulation/chain_equations.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "host_tools/simulation/reference_integrators.hpp"
#include "tests/host_tools/simulation/integrator_functions.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulation::chain_equations_test {
namespace {

using host_tools_test::thrown_message;

ChainDynamics three_masses() {
  ChainDynamics chain;
  chain.masses = 3;
  chain.mass = {2.0, 4.0, 8.0};
  chain.stiffness = {10.0, 20.0, 30.0};
  chain.damping = {1.0, 2.0, 3.0};
  chain.base_damping = 0.5;
  chain.friction = 0.25;
  return chain;
}

TEST(ChainEquations, ForcesAreThoseOfTheDrawing) {
  const ChainDynamics chain = three_masses();
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
  ChainDynamics chain;
  chain.mass[0] = 1.0;
  chain.friction = 0.25;
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
  ChainState state;
  state.position = {1.0, 2.0, 3.0};
  state.velocity = {4.0, 5.0, 6.0};
  EXPECT_EQ((ChainEquations<2>::vector_of(state)), (std::array{1.0, 2.0, 4.0, 5.0}));
  ChainEquations<2>::store({10.0, 20.0, 40.0, 50.0}, state);
  EXPECT_EQ(state.position, (std::array{10.0, 20.0, 3.0}));
  EXPECT_EQ(state.velocity, (std::array{40.0, 50.0, 6.0}));
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
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

const std::vector<std::pair<const char*, Integrator>>& all() {
  static const std::vector<std::pair<const char*, Integrator>> integrators{
      {"semi-implicit Euler", euler(1e-4)}, {"rk4", rk4(1e-4)}, {"adaptive", adaptive(1e-9)}};
  return integrators;
}

ChainDynamics held() {
  ChainDynamics chain;
  chain.masses = 2;
  chain.mass = {0.045, 0.234, 0.0};
  chain.stiffness = {540.0, 147.0, 0.0};
  chain.damping = {1.7, 9.1, 0.0};
  chain.base_damping = 0.05;
  chain.friction = 0.093;
  return chain;
}
ChainDynamics block_of(double mass) {
  ChainDynamics chain;
  chain.mass[0] = mass;
  return chain;
}

TEST(ReferenceIntegratorsRefuse, WhatCannotBeAndLeaveTheStateAlone) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
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
  for (const auto& [name, integrate] : all()) {
    for (const Case& bad : cases) {
      ChainDynamics chain = held();
      ChainState state;
      state.position = {0.1, 0.2, 0.3};
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
  const ChainDynamics chain = block_of(1.0);
  ChainState state;
  for (const double step : {0.0, -1.0, 1e-13, std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity()}) {
    for (const Integrator& integrate : {euler(step), rk4(step)})
      EXPECT_CONTAINS(thrown_message<std::invalid_argument>([&] { integrate(chain, state, {}, 0.002); }),
                      "step = ");
  }
  for (const double tolerance : {0.0, -1e-6, 0.99e-14, 0.011, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_CONTAINS(thrown_message<std::invalid_argument>(
                        [&] { integrate_adaptive(chain, state, {}, 0.002, tolerance); }),
                    "allowed is a number from 1e-14 to 0.01");
  }
}

TEST(ReferenceIntegratorsRefuse, StepsThatAreTooLongInWordsAndNotInNumbers) {
  ChainDynamics chain = block_of(1e-3);
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

}  // namespace
}  // namespace kmax::simulation::chain_equations_test
