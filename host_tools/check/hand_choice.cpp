#include "host_tools/check/hand_choice.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/toml_text.hpp"
#include "host_tools/simulation/operator_model.hpp"
#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::check {

namespace {
control::Hand<double> hand_of(const simulation::OperatorModel& person) {
  return {person.hand_mass, person.grip_stiffness, person.grip_damping, person.arm_stiffness,
          person.arm_damping};
}

simulation::OperatorModel read_person(const std::string& path) {
  const std::string text = base::text_of<base::ValueError>(
      path, "--hand takes none, subject_1, or the path of a TOML file with [operator]");
  const simulation::SceneTables tables(path);
  const toml::table root = base::parsed_toml<simulation::SceneError>(text, path);
  const toml::table* table = tables.part(root, "", "operator");
  if (table == nullptr)
    tables.fail(root.source(),
                "[operator] is missing: it describes the hand (grip_stiffness, hand_mass, ...)");
  simulation::OperatorModel person;
  tables.read_model(*table, "operator.", simulation::operator_fields, person);
  return person;
}
}  // namespace

HandChoice choose_hand(const std::string& text) {
  if (text == "none") return {text, {}};
  if (text == "subject_1") return {text, hand_of(simulation::OperatorModel{})};
  return {text, hand_of(read_person(text))};
}

}  // namespace kmax::check
