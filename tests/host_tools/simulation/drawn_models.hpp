#pragma once
// Devices and people with any parameters, each drawn evenly on a logarithmic scale, for properties.

#include <rapidcheck.h>

#include <cmath>

#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

inline double drawn_between(double low, double high) {
  return low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0);
}

inline DeviceModel drawn_device() {
  DeviceModel device;
  device.mass = drawn_between(1e-3, 0.5);
  device.damping = drawn_between(1e-3, 2.0);
  device.friction = drawn_between(1e-3, 1.0);
  return device;
}

inline OperatorModel drawn_person() {
  OperatorModel person;
  person.grip_stiffness = drawn_between(50.0, 5e4);
  person.grip_damping = drawn_between(1e-2, 10.0);
  person.hand_mass = drawn_between(0.02, 1.0);
  person.arm_stiffness = drawn_between(20.0, 1000.0);
  person.arm_damping = drawn_between(0.1, 30.0);
  return person;
}

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
