#pragma once

#include <rapidcheck.h>

#include "host_tools/simulation/coupled_handle.hpp"

namespace kmax::simulation {

// Under drawn forces of up to 3.3 N the handle's energy never rises by more than the work that they do.
inline void require_no_energy_from_nowhere(CoupledHandle& handle, int samples, double period) {
  double energy = handle.energy();
  for (int n = 0; n < samples; ++n) {
    const double force = *rc::gen::inRange(-330, 331) * 0.01;
    const double before = handle.position();
    handle.advance(force, 0.0, period);
    const double work = force * (handle.position() - before);
    RC_ASSERT(handle.energy() <= energy + work + 1e-12);
    energy = handle.energy();
  }
}

}  // namespace kmax::simulation
