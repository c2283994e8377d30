#include "host_tools/simulation/chain_equations.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulation::chain_equations_test {
namespace {

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
  host_tools_test::thrown_message<std::runtime_error>([&] { ChainEquations<1>::store({0.0, nan}, state); });
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

}  // namespace
}  // namespace kmax::simulation::chain_equations_test
