#pragma once
// The chain of masses that a device, its structure and the person who holds it make (chain_dynamics.hpp).

#include <cstddef>

#include "host_tools/simulation/chain_dynamics.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

// `person`: nullptr if nobody holds it. `gain`: the activation g, by which grip and arm are multiplied.
inline ChainDynamics held_chain(const DeviceModel& device, const OperatorModel* person, double gain) {
  ChainDynamics chain;
  chain.mass[0] = device.mass;
  chain.base_damping = device.damping;
  chain.friction = device.friction;
  if (device.structure) {
    chain.stiffness[0] = device.structure->stiffness;
    chain.damping[0] = device.structure->damping;
    chain.mass[chain.masses++] = device.structure->handle_mass;
  }
  if (person != nullptr) {
    const std::size_t grip = chain.masses - 1;
    chain.stiffness[grip] = person->grip_stiffness * gain;
    chain.damping[grip] = person->grip_damping * gain;
    chain.mass[chain.masses++] = person->hand_mass;
    chain.stiffness[grip + 1] = person->arm_stiffness * gain;
    chain.damping[grip + 1] = person->arm_damping * gain;
  }
  return chain;
}

}  // namespace kmax::simulation
