#pragma once
// The integrators of reference_integrators.hpp as functions of one form, their step or tolerance bound.

#include <functional>

#include "host_tools/simulation/reference_integrators.hpp"

namespace kmax::simulation {

using Integrator = std::function<void(const ChainDynamics&, ChainState&, const ChainInput&, double duration)>;

inline Integrator euler(double step) {
  return [step](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_semi_implicit_euler(d, s, i, duration, step);
  };
}

inline Integrator rk4(double step) {
  return [step](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_rk4(d, s, i, duration, step);
  };
}

inline Integrator adaptive(double tolerance) {
  return [tolerance](const ChainDynamics& d, ChainState& s, const ChainInput& i, double duration) {
    integrate_adaptive(d, s, i, duration, tolerance);
  };
}

}  // namespace kmax::simulation
