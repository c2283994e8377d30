#pragma once
// The mechanical side of one axis of a haptic device, seen at the handle: a mass with viscous and Coulomb
// friction, driven by a force that the motor can supply only up to a limit and, if wanted, late; and behind
// it, if wanted, a structure that bends.

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

// A device that bends: a spring and a damper between the motor's side, where the encoder counts, and the
// handle, where the person holds it (one compliance in series: a cable drive, a belt, a slender arm).
//
//   motor side, DeviceModel::mass --(stiffness | damping)-- handle_mass, at tip_position()
//
// Friction stays on the motor's side. The spring is at rest when both are at the same position.

// Defaults: a device whose 45 g are moved half by half, first resonance at 159 Hz with the motor held. Meant
// as a start for one's own numbers, taken from no particular device.
struct StructureModel {
  double stiffness = 20000.0;  // N/m
  double damping = 1.0;        // N s/m
  double handle_mass = 0.02;   // kg, behind the compliance
};

inline constexpr std::array structure_fields{
    ModelField<StructureModel>{"stiffness", &StructureModel::stiffness, 1.0, 1e8, "N/m",
                               "stiffness of the compliance between motor side and handle"},
    ModelField<StructureModel>{"damping", &StructureModel::damping, 0.0, 1000.0, "N s/m",
                               "damping beside it"},
    ModelField<StructureModel>{"handle_mass", &StructureModel::handle_mass, 1e-4, 100.0, "kg",
                               "mass of the handle, behind the compliance"},
};

// Throws std::invalid_argument.
inline void validate(const StructureModel& structure) {
  require_allowed(structure, std::span<const ModelField<StructureModel>>(structure_fields), "structure");
}

// Defaults: a desktop device of the Geomagic Touch class. 45 g is its apparent tip mass and 3.3 N its peak
// force (paper 1, section 4). Viscous damping and Coulomb friction are not published; 0.05 N s/m and 0.093 N
// are those of a first study, which fitted them so that twelve hands have a plain K_max of 3.58 N/mm at 500
// Hz (paper 1, fig. 6). For the twelve hands that the experiments draw, 0.122 N does that
// (host_tools/experiment/people/subjects); for 25 draws 0.08 to 0.15 N. Mass, damping and friction cannot be
// told apart from that one number, so this is calibration, not measurement.
struct DeviceModel {
  double mass = 0.045;       // kg; with a structure that of the motor's side alone
  double damping = 0.05;     // N s/m
  double friction = 0.093;   // N, Coulomb: the same standing and moving
  double force_limit = 3.3;  // N; a commanded force beyond it is clipped; 0 = never clipped
  double delay = 0.0;  // s, from a command to its force at the handle; before the first arrives it is 0 N
  std::optional<StructureModel> structure{};  // none: the handle is the motor's side itself
};

inline constexpr std::array device_fields{
    ModelField<DeviceModel>{"mass", &DeviceModel::mass, 1e-4, 100.0, "kg",
                            "mass at the handle; with a [structure], of the motor side alone"},
    ModelField<DeviceModel>{"damping", &DeviceModel::damping, 0.0, 1000.0, "N s/m", "viscous damping"},
    ModelField<DeviceModel>{"friction", &DeviceModel::friction, 0.0, 1000.0, "N",
                            "Coulomb friction, the same standing and moving"},
    ModelField<DeviceModel>{"force_limit", &DeviceModel::force_limit, 0.0, 1e5, "N",
                            "largest force of the device; what is commanded beyond it is clipped",
                            "0: no limit"},
    ModelField<DeviceModel>{"delay", &DeviceModel::delay, 0.0, 1.0, "s",
                            "from a command to its force at the handle"},
};

// Puts a compliance of `stiffness` N/m between motor and hand, and of the mass behind it what a structure has
// by default, at most half.
inline void bend(DeviceModel& device, double stiffness) {
  device.structure = StructureModel{.stiffness = stiffness};
  device.structure->handle_mass = std::min(device.structure->handle_mass, 0.5 * device.mass);
  device.mass -= device.structure->handle_mass;
}

// Throws std::invalid_argument.
inline void validate(const DeviceModel& device) {
  require_allowed(device, std::span<const ModelField<DeviceModel>>(device_fields), "device");
  if (device.structure) validate(*device.structure);
}

}  // namespace kmax::simulation
