#pragma once
// The equations of a held device as a chain of one to three masses, seen along one axis:
//
//   force -> mass 0 --(k0 | b0)-- mass 1 --(k1 | b1)-- mass 2 --(k2 | b2)-- u
//
// Mass 0 is where the motor pulls, where the encoder counts and where viscous and Coulomb friction act. What
// follows depends on the parts that a scene names: the handle behind a compliant structure, the hand behind
// its grip. The spring of the last mass goes to the intended position u, and is 0 without a person. A part
// that is not there is no mass of the chain.
//
// Every integrator of the simulation works on this description (coupled_handle.hpp,
// reference_integrators.hpp).

#include <array>
#include <cstddef>

namespace kmax::simulation {

inline constexpr std::size_t most_masses = 3;

struct ChainDynamics {
  std::size_t masses = 1;                       // 1 to 3
  std::array<double, most_masses> mass{};       // kg
  std::array<double, most_masses> stiffness{};  // N/m, [i] between mass i and i + 1, the last to u
  std::array<double, most_masses> damping{};    // N s/m, likewise
  double base_damping = 0.0;                    // N s/m, viscous, of mass 0 against the ground
  double friction = 0.0;  // N, Coulomb, of mass 0 against the ground; standing and moving
};

// `chain` with its springs and dampers from number `first` on times `gain`.
inline ChainDynamics stiffened(ChainDynamics chain, std::size_t first, double gain) {
  for (std::size_t i = first; i < chain.masses; ++i) {
    chain.stiffness[i] *= gain;
    chain.damping[i] *= gain;
  }
  return chain;
}

struct ChainState {
  std::array<double, most_masses> position{};  // m
  std::array<double, most_masses> velocity{};  // m/s; velocity[0] is exactly 0 while mass 0 sticks
};

// What acts on the chain over an interval: a held force on mass 0, and u moving on a straight line.
struct ChainInput {
  double force = 0.0;          // N, along +x
  double intended = 0.0;       // m, u at the interval's beginning
  double intended_rate = 0.0;  // m/s
};

}  // namespace kmax::simulation
