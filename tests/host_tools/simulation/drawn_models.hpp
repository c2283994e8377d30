#pragma once
// Devices and people with any parameters, each drawn evenly on a logarithmic scale, for properties.

#include <rapidcheck.h>

#include <cmath>

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

}  // namespace kmax::simulation
