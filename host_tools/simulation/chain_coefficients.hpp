#pragma once
// The numbers that solving a chain of masses needs again and again (chain_dynamics.hpp), and two rigorous
// bounds that say without solving it that nothing happens within an interval.
//
// Bounds. With a held force and u moving on a straight line, the velocities of a chain obey the chain's own
// equations without any force, u replaced by its constant rate. So the energy of the derivative,
//
//   2 E' = sum of m_i v_i'^2 + sum of k_i (v_i+1 - v_i)^2,      (v after the last mass: the rate of u)
//
// never grows while mass 0 slides in one direction or sticks; dampers only take from it. From E' at the
// interval's beginning follows for all of it, by the Cauchy-Schwarz inequality, with k, b the spring and
// damper between mass 0 and mass 1:
//
//   sliding    |v_0''|^2 <= 2 E' (k + (b + b_base)^2 / m_0 + b^2 / m_1) / m_0^2            (largest jerk)
//   sticking   |d(net force on mass 0)/dt|^2 <= 2 E' (k + b^2 / m_1)
//
// Stiffness and damping are >= 0, which the models see to.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "host_tools/simulation/chain_dynamics.hpp"

namespace kmax::simulation {

template <std::size_t masses>
struct ChainCoefficients {
  std::array<double, masses> mass{};
  std::array<double, masses> per_mass{};
  std::array<double, masses> stiffness{};
  std::array<double, masses> damping{};
  double base_damping = 0.0;
  double friction = 0.0;
  double sliding_rate = 0.0;  // bounds on the norm of the chain's matrix, 1/s: sliding, and with mass 0 held
  double stuck_rate = 0.0;
  double sliding_spring_rate = 0.0;  // the springs' part of them
  double stuck_spring_rate = 0.0;

  explicit ChainCoefficients(const ChainDynamics& chain)
      : base_damping(chain.base_damping), friction(chain.friction) {
    for (std::size_t i = 0; i < masses; ++i) {
      mass[i] = chain.mass[i];
      per_mass[i] = 1.0 / chain.mass[i];
      stiffness[i] = chain.stiffness[i];
      damping[i] = chain.damping[i];
    }
    sliding_rate = rate_bound(0, sliding_spring_rate);
    if constexpr (masses > 1) stuck_rate = rate_bound(1, stuck_spring_rate);
  }

  // The springs and dampers from number `first` on times `gain` >= 1. `unscaled`: the same with a gain of 1.
  void scale(const ChainCoefficients& unscaled, std::size_t first, double gain) {
#pragma GCC unroll 3
    for (std::size_t i = 0; i < masses; ++i) {
      if (i < first) continue;
      stiffness[i] = unscaled.stiffness[i] * gain;
      damping[i] = unscaled.damping[i] * gain;
    }
    // sqrt(gain) <= (1 + gain) / 2, without the root
    const double root = 0.5 * (1.0 + gain);
    sliding_rate =
        unscaled.sliding_spring_rate * root + (unscaled.sliding_rate - unscaled.sliding_spring_rate) * gain;
    stuck_rate =
        unscaled.stuck_spring_rate * root + (unscaled.stuck_rate - unscaled.stuck_spring_rate) * gain;
  }
  double largest_rate() const {
    return std::max(sliding_rate, stuck_rate);
  }

  static constexpr std::size_t last = masses - 1;

  // What u does to the last mass, m/s^2 at the interval's beginning, with the last mass at the origin of
  // `intended`; and how fast that changes, m/s^3.
  double pull(double intended, double rate) const {
    return (stiffness[last] * intended + damping[last] * rate) * per_mass[last];
  }
  double pull_rate(double rate) const {
    return stiffness[last] * rate * per_mass[last];
  }

  // Square of the largest jerk of mass 0 per 2 E'.
  double jerk_factor() const {
    const double base = damping[0] + base_damping;
    return (stiffness[0] + base * base * per_mass[0] + neighbour_factor()) * per_mass[0] * per_mass[0];
  }
  // Square of the fastest change of the net force on a held mass 0 per 2 E'.
  double force_rate_factor() const {
    return masses > 1 ? stiffness[0] + neighbour_factor() : 0.0;
  }

 private:
  // Largest row sum of the chain's matrix in the coordinates (W x_i, v_i), W^2 the largest sum of |spring
  // terms| of a mass: a bound on its norm, 1/s. `first`: 0 sliding, 1 with mass 0 held.
  double rate_bound(std::size_t first, double& spring_rate) const {
    double spring = 0.0;
    double damper = 0.0;
    for (std::size_t i = first; i < masses; ++i) {
      double springs = (i == last ? 1.0 : 2.0) * stiffness[i];
      double dampers = (i == last ? 1.0 : 2.0) * damping[i];
      if (i > 0) {
        const double share = i == first ? 1.0 : 2.0;
        springs += share * stiffness[i - 1];
        dampers += share * damping[i - 1];
      } else {
        dampers += base_damping;
      }
      spring = std::max(spring, springs * per_mass[i]);
      damper = std::max(damper, dampers * per_mass[i]);
    }
    spring_rate = std::sqrt(spring);
    return spring_rate + damper;
  }
  double neighbour_factor() const {
    if constexpr (masses > 1) return damping[0] * damping[0] * per_mass[1];
    return 0.0;
  }
};

}  // namespace kmax::simulation
