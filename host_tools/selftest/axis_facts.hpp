#pragma once

#include <cstdint>

#include "host_tools/device/device.hpp"

namespace kmax::selftest {

/// What the parameters claim about an axis; SI units.
struct AxisFacts {
  bool synchronous = false;  ///< else a DC motor on the legs B and C
  double resistance = 1.0, inductance = 1e-3, torque_constant = 0.05;
  int pole_pairs = 7;
  double electrical_offset = 0.0;  ///< rad
  bool calibrated = false;
  bool commutation_known = false;
  double current_limit = 5.0;
  double mass = 0.05, transmission = 0.05;
  double counts_per_turn = 8192, count_length = 1e-6;
  double tick = 50e-6;  ///< s
  double supply_min = 8.0, supply_max = 26.0;
  double temperature_limit = 100.0;

  /// V/(A s): what a free handle induces after an impulse of current.
  double free_back_emf() const {
    return torque_constant * torque_constant / (mass * transmission * transmission);
  }
  /// m/(A s2): acceleration of a free handle per ampere.
  double free_acceleration() const { return torque_constant / (mass * transmission); }
};

AxisFacts read_facts(device::Device& device, std::size_t axis);

}  // namespace kmax::selftest
