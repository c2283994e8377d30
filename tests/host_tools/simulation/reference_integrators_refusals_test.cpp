// What the reference integrators refuse: arguments that cannot be, steps that are too long.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "host_tools/simulation/reference_integrators.hpp"
#include "tests/host_tools/simulation/integrator_functions.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulation::reference_integrators_refusals_test {
namespace {

using host_tools_test::thrown_message;

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
}  // namespace kmax::simulation::reference_integrators_refusals_test
