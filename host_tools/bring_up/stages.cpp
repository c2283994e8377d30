#include "host_tools/bring_up/stages.hpp"

#include <algorithm>
#include <array>

namespace kmax::bring_up {

namespace {
constexpr std::array stages = {
    StageText{Stage::logic, "logic", "link, supply, temperature, emergency stop",
              "DC: a laboratory supply of 12 to 24 V, limited to 0.5 A. J3: CAN or the serial line, and the "
              "emergency stop's contact, or a wire, between GPIO5 and GND. Nothing at M0, M1 and AUX.",
              "Only reads; no axis is armed."},
    StageText{
        Stage::gate_drivers, "gate_drivers", "gate drivers, bridges and current sensors without a motor",
        "As before: nothing at M0, M1 and AUX.",
        "Arms with 0 V, then gives pulses of a few milliseconds, of up to 40 % of the supply. No current may "
        "flow. Asks you to press the emergency stop while 0 V are on."},
    StageText{
        Stage::load, "load", "current through all phases",
        "The motor, its shaft held fast (or three equal resistors of 1 to 10 ohm in a star): leads A, B, C; "
        "a brushed motor at B and C. Supply limited to 2 A.",
        "Pulses of up to 40 % of current.limit for a few milliseconds."},
    StageText{
        Stage::motor, "motor", "encoder, and the direction of everything",
        "Motor and encoder (J4, or J3 for an AS5047P), the handle free to move. AUX: the brake resistor, if "
        "there is one.",
        "Asks you to move the handle; then moves it by less than 1 mm. excitation.travel stops it at 0.8 "
        "mm."},
    StageText{Stage::calibration, "calibration",
              "what the control needs to know of motor, encoder and handle",
              "As before; the handle free over 20 mm to either side, and nobody holds it.",
              "Moves the handle by up to 20 mm to either side with half of current.limit, and saves what it "
              "finds."},
    StageText{
        Stage::wall, "wall", "the first wall, of 0.5 N/mm and 1 N at most",
        "As before; a hand at the handle, 10 mm of free way on the wall's side.",
        "Arms for at most 20 s a touch. The wall is 5 mm from where the handle is; force.limit is 1 N."},
    StageText{Stage::stiffer, "stiffer", "the stiffest wall that the stability criteria allow", "As before.",
              "Sets what 'kmax check' finds stable, at most what --stiffness says; force.limit is 3 N."},
};
}  // namespace

std::span<const StageText> all_stages() {
  return stages;
}

const StageText& text_of(Stage stage) {
  return stages.at(static_cast<std::size_t>(stage));
}

std::optional<Stage> stage_named(std::string_view name) {
  const auto found =
      std::find_if(stages.begin(), stages.end(), [name](const StageText& text) { return text.name == name; });
  return found == stages.end() ? std::nullopt : std::optional(found->stage);
}

}  // namespace kmax::bring_up
