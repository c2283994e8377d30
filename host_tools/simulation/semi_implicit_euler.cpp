#include <cmath>

#include "host_tools/simulation/chain_equations.hpp"
#include "host_tools/simulation/reference_integrators.hpp"

namespace kmax::simulation {
namespace {

// The new velocity of mass 0. The friction opposes the motion; where it would turn the mass round, friction
// holds it, or the rest of the step runs the other way.
template <std::size_t masses>
double next_velocity(const ChainEquations<masses>& equations,
                     const typename ChainEquations<masses>::Vector& s, double force, double h) {
  const double velocity = s[masses];
  const double per_mass = equations.per_mass(0);
  const double friction = equations.friction();
  if (velocity == 0.0) {
    if (equations.holds(s, force)) return 0.0;
    return h * per_mass * (force - std::copysign(friction, force));
  }
  const double opposed = std::copysign(friction, velocity);
  const double next = velocity + h * per_mass * (force - opposed);
  if (next == 0.0 || std::signbit(next) == std::signbit(velocity)) return next;
  if (equations.holds(s, force)) return 0.0;
  const double left = h * (next / (next - velocity));  // after the instant of rest
  return left * per_mass * (force + opposed);
}

template <std::size_t masses>
void step(const ChainEquations<masses>& equations, typename ChainEquations<masses>::Vector& s, double t,
          double h) {
  const auto force = equations.forces(s, t);
  s[masses] = next_velocity(equations, s, force[0], h);
  for (std::size_t i = 1; i < masses; ++i) s[masses + i] += h * equations.per_mass(i) * force[i];
  for (std::size_t i = 0; i < masses; ++i) s[i] += h * s[masses + i];
}

}  // namespace

void integrate_semi_implicit_euler(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input,
                                   double duration, double longest_step) {
  require_sound(dynamics, state, input, duration);
  const long steps = equal_steps(duration, longest_step);
  const double h = duration / static_cast<double>(steps);
  with_equations(dynamics, input, [&](const auto& equations) {
    auto s = equations.vector_of(state);
    for (long n = 0; n < steps; ++n) step(equations, s, h * static_cast<double>(n), h);
    equations.store(s, state);
  });
}

}  // namespace kmax::simulation
