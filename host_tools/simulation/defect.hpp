#pragma once
// What can be wrong with an axis, by name. A scene lists names ([motor] defects = ["phase_b_open"]); a test
// plants and mends them at run time (SceneDrives::plant).

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace kmax::simulation {

enum class Defect : std::uint8_t {
  phase_a_open,  // the wire of the motor's terminal A; a DC motor has none there
  phase_b_open,
  phase_c_open,
  phases_swapped,      // B and C have changed places
  encoder_unplugged,   // the lines are pulled up, the serial chip does not answer
  encoder_stuck,       // the disc does not turn with the shaft
  encoder_reversed,    // counts against its mounting
  encoder_slipping,    // the disc loses a third of the travel
  supply_low,          // the source gives half of its voltage, and the capacitor holds no more
  motor_blocked,       // the handle does not move
  current_b_inverted,  // the shunt's wires of leg B are exchanged
  current_c_inverted,
  gate_driver_missing,  // it does not answer, and the converter's pins of the currents float
  index_loose,          // the encoder's line Z is off, and is pulled up
};

struct DefectName {
  Defect defect;
  std::string_view name;
};

inline constexpr std::array defect_names{
    DefectName{Defect::phase_a_open, "phase_a_open"},
    DefectName{Defect::phase_b_open, "phase_b_open"},
    DefectName{Defect::phase_c_open, "phase_c_open"},
    DefectName{Defect::phases_swapped, "phases_swapped"},
    DefectName{Defect::encoder_unplugged, "encoder_unplugged"},
    DefectName{Defect::encoder_stuck, "encoder_stuck"},
    DefectName{Defect::encoder_reversed, "encoder_reversed"},
    DefectName{Defect::encoder_slipping, "encoder_slipping"},
    DefectName{Defect::supply_low, "supply_low"},
    DefectName{Defect::motor_blocked, "motor_blocked"},
    DefectName{Defect::current_b_inverted, "current_b_inverted"},
    DefectName{Defect::current_c_inverted, "current_c_inverted"},
    DefectName{Defect::gate_driver_missing, "gate_driver_missing"},
    DefectName{Defect::index_loose, "index_loose"},
};

constexpr std::string_view name_of(Defect defect) {
  return defect_names[static_cast<std::size_t>(defect)].name;
}

constexpr std::optional<Defect> defect_named(std::string_view name) {
  for (const DefectName& one : defect_names) {
    if (one.name == name) return one.defect;
  }
  return std::nullopt;
}

}  // namespace kmax::simulation
