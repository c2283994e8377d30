#pragma once
// The right-hand side of chain_dynamics.hpp for integrators that work on a plain vector, and the checks that
// they share. The number of masses is a template argument: a mass that is not there costs nothing.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include <fmt/format.h>

#include "host_tools/simulation/chain_dynamics.hpp"

namespace kmax::simulation {

// What the friction on mass 0 does: it holds the mass, or pulls against a direction of motion of +1 or -1.
enum class Contact : signed char { backwards = -1, sticking = 0, forwards = 1 };

template <std::size_t masses>
class ChainEquations {
 public:
  // Positions first, then velocities.
  using Vector = std::array<double, 2 * masses>;

  ChainEquations(const ChainDynamics& dynamics, const ChainInput& input)
      : dynamics_(dynamics), input_(input) {
    for (std::size_t i = 0; i < masses; ++i) per_mass_[i] = 1.0 / dynamics.mass[i];
  }

  static Vector vector_of(const ChainState& state) {
    Vector s;
    for (std::size_t i = 0; i < masses; ++i) {
      s[i] = state.position[i];
      s[masses + i] = state.velocity[i];
    }
    return s;
  }
  // Throws std::runtime_error instead of storing what is not finite.
  static void store(const Vector& s, ChainState& state) {
    for (const double value : s) {
      if (!std::isfinite(value)) [[unlikely]]
        throw std::runtime_error("the integration has diverged: the step is too long for this chain");
    }
    for (std::size_t i = 0; i < masses; ++i) {
      state.position[i] = s[i];
      state.velocity[i] = s[masses + i];
    }
  }

  // Forces on all masses at time `t` of the interval, without Coulomb's; N.
  std::array<double, masses> forces(const Vector& s, double t) const {
    std::array<double, masses> force{};
    force[0] = input_.force - dynamics_.base_damping * s[masses];
    for (std::size_t i = 0; i < masses; ++i) {
      const bool last = i + 1 == masses;
      const double next = last ? input_.intended + input_.intended_rate * t : s[i + 1];
      const double next_velocity = last ? input_.intended_rate : s[masses + i + 1];
      const double link =
          dynamics_.stiffness[i] * (next - s[i]) + dynamics_.damping[i] * (next_velocity - s[masses + i]);
      force[i] += link;
      if (!last) force[i + 1] -= link;
    }
    return force;
  }

  // The largest net force that friction holds mass 0 against, N; negative without friction. What it has above
  // f_c is of the size of rounding and gives every break-away a direction.
  double stick_limit(const Vector& s) const {
    if (dynamics_.friction == 0.0) return -1.0;
    double sum = dynamics_.friction + std::abs(input_.force) + dynamics_.stiffness[0] * std::abs(s[0]);
    if constexpr (masses > 1)
      sum += dynamics_.stiffness[0] * std::abs(s[1]) + dynamics_.damping[0] * std::abs(s[masses + 1]);
    return dynamics_.friction + 1e-13 * sum;
  }
  bool holds(const Vector& s, double net) const { return std::abs(net) <= stick_limit(s); }

  // The state of contact of a mass 0 whose velocity is s[masses].
  Contact contact(const Vector& s, double t) const {
    if (s[masses] != 0.0) return s[masses] > 0.0 ? Contact::forwards : Contact::backwards;
    const double net = forces(s, t)[0];
    return holds(s, net) ? Contact::sticking : pulled(net);
  }
  static Contact pulled(double net) { return net >= 0.0 ? Contact::forwards : Contact::backwards; }

  Vector derivative(const Vector& s, double t, Contact contact) const {
    const std::array<double, masses> force = forces(s, t);
    Vector rate;
    for (std::size_t i = 0; i < masses; ++i) {
      rate[i] = s[masses + i];
      rate[masses + i] = force[i] * per_mass_[i];
    }
    if (contact == Contact::sticking) {
      rate[0] = rate[masses] = 0.0;
    } else {
      rate[masses] -= static_cast<double>(contact) * dynamics_.friction * per_mass_[0];
    }
    return rate;
  }

  double friction() const { return dynamics_.friction; }
  double per_mass(std::size_t i) const { return per_mass_[i]; }

 private:
  const ChainDynamics& dynamics_;
  const ChainInput& input_;
  std::array<double, masses> per_mass_{};
};

// The first argument that cannot be, in words, is thrown as std::invalid_argument.
inline void require_sound(const ChainDynamics& dynamics, const ChainState& state, const ChainInput& input,
                          double duration) {
  if (dynamics.masses < 1 || dynamics.masses > most_masses) {
    throw std::invalid_argument(fmt::format("chain of {} masses: allowed are 1 to 3", dynamics.masses));
  }
  const auto require = [](bool sound, const char* what, double value, const char* allowed) {
    if (!sound) [[unlikely]]
      throw std::invalid_argument(fmt::format("{} = {}: allowed is {}", what, value, allowed));
  };
  const auto not_negative = [](double value) { return value >= 0.0 && std::isfinite(value); };
  for (std::size_t i = 0; i < dynamics.masses; ++i) {
    require(
        dynamics.mass[i] > 0.0 && std::isfinite(dynamics.mass[i]) && std::isfinite(1.0 / dynamics.mass[i]),
        "chain mass", dynamics.mass[i], "a finite number above 0 kg");
    require(not_negative(dynamics.stiffness[i]), "chain stiffness", dynamics.stiffness[i], "0 N/m or more");
    require(not_negative(dynamics.damping[i]), "chain damping", dynamics.damping[i], "0 N s/m or more");
    require(std::isfinite(state.position[i]), "chain position", state.position[i], "a finite number");
    require(std::isfinite(state.velocity[i]), "chain velocity", state.velocity[i], "a finite number");
  }
  require(not_negative(dynamics.base_damping), "chain base damping", dynamics.base_damping,
          "0 N s/m or more");
  require(not_negative(dynamics.friction), "chain friction", dynamics.friction, "0 N or more");
  require(std::isfinite(input.force), "chain force", input.force, "a finite number");
  require(std::isfinite(input.intended), "intended position", input.intended, "a finite number");
  require(std::isfinite(input.intended_rate), "intended rate", input.intended_rate, "a finite number");
  require(duration > 0.0 && duration <= 10.0, "duration", duration, "above 0 to 10 s");
}

// Equal steps no longer than `step`. Throws std::invalid_argument.
inline long equal_steps(double duration, double step) {
  if (!(step > 0.0) || !std::isfinite(step) || duration / step > 1e9) {
    throw std::invalid_argument(fmt::format(
        "step = {} s over {} s: allowed is a number above 0 that gives at most 1e9 steps", step, duration));
  }
  return std::max(1L, static_cast<long>(std::ceil(duration / step - 1e-9)));
}

// Calls `integrate` with the equations of the chain's number of masses.
template <typename Integrate>
void with_equations(const ChainDynamics& dynamics, const ChainInput& input, Integrate integrate) {
  switch (dynamics.masses) {
    case 1:
      return integrate(ChainEquations<1>(dynamics, input));
    case 2:
      return integrate(ChainEquations<2>(dynamics, input));
    default:
      return integrate(ChainEquations<3>(dynamics, input));
  }
}

// Where a function of time passes through zero, for integrators that can only be asked for its values.

// A zero of `value` between `low`, where it is positive, and `high`, where it is not: regula falsi in the
// Illinois form (the value at an end that stays is halved), bisection after 40 steps, at most 100; to 1e-15
// of the bracket's upper end. Returns the upper end of the last bracket: the event has just happened.
template <typename Value>
double falling_zero_of(const Value& value, double low, double high) {
  double at_low = value(low);
  double at_high = value(high);
  if (!(at_low > 0.0)) return low;
  if (at_high >= 0.0) return high;
  int side = 0;
  for (int n = 0; n < 100 && high - low > 1e-15 * high; ++n) {
    double middle = (low * at_high - high * at_low) / (at_high - at_low);
    if (n >= 40 || !(middle > low && middle < high)) middle = 0.5 * (low + high);
    const double at_middle = value(middle);
    if (at_middle == 0.0) return middle;
    if (at_middle > 0.0) {
      if (side > 0) at_high *= 0.5;
      low = middle;
      at_low = at_middle;
      side = 1;
    } else {
      if (side < 0) at_low *= 0.5;
      high = middle;
      at_high = at_middle;
      side = -1;
    }
  }
  return high;
}

// `value` starts at zero at time 0 and is negative at `end`: a time at which it is positive in between, for
// falling_zero_of; or -1 if there is none down to 2^-40 of the time.
template <typename Value>
double moving_start(const Value& value, double end) {
  double t = end;
  for (int n = 0; n < 40; ++n) {
    t *= 0.5;
    if (value(t) > 0.0) return t;
  }
  return -1.0;
}

}  // namespace kmax::simulation
