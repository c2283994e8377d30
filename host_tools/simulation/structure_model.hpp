#pragma once
// A device that bends: a spring and a damper between the motor's side, where the encoder counts, and the
// handle, where the person holds it (one compliance in series: a cable drive, a belt, a slender arm).
//
//   motor side, DeviceModel::mass --(stiffness | damping)-- handle_mass, at tip_position()
//
// Friction stays on the motor's side. The spring is at rest when both are at the same position.

#include <array>
#include <span>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

// Defaults: a device whose 45 g are moved half by half, first resonance at 159 Hz with the motor held. Meant
// as a start for one's own numbers, taken from no particular device.
struct StructureModel {
  double stiffness = 20000.0;  // N/m
  double damping = 1.0;        // N s/m
  double handle_mass = 0.02;   // kg, behind the compliance
};

inline constexpr std::array structure_fields{
    ModelField<StructureModel>{"stiffness", &StructureModel::stiffness, 1.0, 1e8, "N/m"},
    ModelField<StructureModel>{"damping", &StructureModel::damping, 0.0, 1000.0, "N s/m"},
    ModelField<StructureModel>{"handle_mass", &StructureModel::handle_mass, 1e-4, 100.0, "kg"},
};

// Throws std::invalid_argument.
inline void validate(const StructureModel& structure) {
  require_allowed(structure, std::span<const ModelField<StructureModel>>(structure_fields), "structure");
}

}  // namespace kmax::simulation
