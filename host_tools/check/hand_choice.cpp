#include "host_tools/check/hand_choice.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "host_tools/base/errors.hpp"
#include "host_tools/simulation/operator_model.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::check {

namespace {
control::Hand<double> hand_of(const simulation::OperatorModel& person) {
  return {person.hand_mass, person.grip_stiffness, person.grip_damping, person.arm_stiffness,
          person.arm_damping};
}

simulation::OperatorModel read_person(const std::string& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw device::ValueError(fmt::format(
        "--hand {}: no such file can be read; allowed is none, subject_1, or a TOML file with [operator]",
        path));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const simulation::SceneTables tables(path);
  toml::table root;
  try {
    root = toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    tables.fail(error.source(), std::string(error.description()));
  }
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
