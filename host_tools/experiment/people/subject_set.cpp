#include <fmt/format.h>
#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>
#include <sstream>

#include "host_tools/base/files.hpp"
#include "host_tools/base/toml_text.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::experiment {

namespace {

using simulation::SceneError;

constexpr std::array fitted_fields{
    simulation::ModelField<Fitted>{"plain", &Fitted::plain_target, 1.0, 1e7, "N/m"},
    simulation::ModelField<Fitted>{"magnetic", &Fitted::magnetic_target, 1.0, 1e7, "N/m"},
    simulation::ModelField<Fitted>{"force_limit", &Fitted::force_limit, 0.0, 1e5, "N", "", "0: no limit"},
};

class SubjectSetReader : private simulation::SceneTables {
 public:
  using SceneTables::SceneTables;

  SubjectSet read(const toml::table& root) const {
    require_known(root, "", {"name", "description", "seed", "fitted", "device", "structure", "subject"});
    SubjectSet set;
    set.name = std::filesystem::path(source()).stem().string();
    read_text(root, "name", set.name);
    read_text(root, "description", set.description);
    if (const toml::node* seed = root.get("seed")) {
      if (!seed->is_integer() || seed->as_integer()->get() < 0)
        fail(seed->source(),
             fmt::format("seed = {}: allowed is a whole number from 0 to 2^63 - 1", text_of(*seed)));
      set.seed = static_cast<std::uint64_t>(seed->as_integer()->get());
    }
    if (const toml::table* fitted = part(root, "", "fitted")) read_fitted(*fitted, set.fitted.emplace());
    if (const toml::table* device = part(root, "", "device"))
      read_model(*device, "device.", simulation::device_fields, set.device);
    if (const toml::table* structure = part(root, "", "structure"))
      read_model(*structure, "structure.", simulation::structure_fields, set.device.structure.emplace());
    read_subjects(root, set);
    return set;
  }

 private:
  // There is no default for what a set was fitted to.
  void read_fitted(const toml::table& table, Fitted& fitted) const {
    read_model(table, "fitted.", fitted_fields, fitted);
    for (const auto& field : fitted_fields) {
      if (table.contains(field.name)) continue;
      fail(table.source(),
           fmt::format("fitted.{} is missing: [fitted] has plain, magnetic and force_limit", field.name));
    }
  }

  void read_subjects(const toml::table& root, SubjectSet& set) const {
    const toml::node* node = root.get("subject");
    if (node == nullptr) fail(root.source(), "[[subject]] is missing: a set has at least one person");
    const toml::array* list = node->as_array();
    if (list == nullptr || list->empty() || !list->is_array_of_tables())
      fail(node->source(), "subject: allowed is one or more tables, each begun with [[subject]]");
    std::set<std::string> names;
    for (const toml::node& entry : *list) {
      const toml::table& table = *entry.as_table();
      Subject subject{fmt::format("subject {}", set.subjects.size() + 1), {}};
      read_model(table, "subject.", simulation::operator_fields, subject.person, {"name"});
      read_text(table, "name", subject.name);
      if (!names.insert(subject.name).second)
        fail(table.source(),
             fmt::format("subject.name = \"{}\": given twice; give each person a name of its own",
                         subject.name));
      set.subjects.push_back(std::move(subject));
    }
  }
};

template <typename Model, std::size_t count>
std::string fields_text(const std::array<simulation::ModelField<Model>, count>& fields, const Model& model) {
  std::string text;
  for (const auto& field : fields) {
    // fmt gives the shortest text that reads back as the same number; TOML wants a float to look like one.
    std::string number = fmt::format("{}", model.*field.member);
    if (number.find_first_of(".e") == std::string::npos) number += ".0";
    text += fmt::format("{} = {}\n", field.name, number);
  }
  return text;
}

std::string quoted(const std::string& text) {
  std::ostringstream stream;
  stream << toml::value<std::string>(text);
  return stream.str();
}

}  // namespace

SubjectSet parse_subject_set(std::string_view text, std::string_view source) {
  return SubjectSetReader(source).read(base::parsed_toml<simulation::SceneError>(text, source));
}

SubjectSet load_subject_set(const std::filesystem::path& path) {
  return parse_subject_set(
      base::text_of<simulation::SceneError>(path, "give the path of a subject set (TOML)"), path.string());
}

SubjectSet open_subject_set(const std::string& name_or_path) {
  std::error_code ignored;
  if (std::filesystem::exists(name_or_path, ignored)) return load_subject_set(name_or_path);
  std::string names;
  for (const SuppliedSubjectSet& set : supplied_subject_sets()) {
    if (set.name == name_or_path) return parse_subject_set(set.text, set.name);
    names += fmt::format("{}{}", names.empty() ? "" : ", ", set.name);
  }
  throw SceneError(fmt::format("{}: there is no such file; allowed is a subject set (TOML) or one of: {}",
                               name_or_path, names));
}

std::string subject_set_text(const SubjectSet& set) {
  std::string text = fmt::format("name = {}\ndescription = {}\nseed = {}\n", quoted(set.name),
                                 quoted(set.description), set.seed);
  if (set.fitted) text += "\n[fitted]\n" + fields_text(fitted_fields, *set.fitted);
  text += "\n[device]\n" + fields_text(simulation::device_fields, set.device);
  if (set.device.structure)
    text += "\n[structure]\n" + fields_text(simulation::structure_fields, *set.device.structure);
  for (const Subject& subject : set.subjects) {
    text += fmt::format("\n[[subject]]\nname = {}\n{}", quoted(subject.name),
                        fields_text(simulation::operator_fields, subject.person));
  }
  return text;
}

void store_subject_set(const SubjectSet& set, const std::filesystem::path& path) {
  base::write_file(path, subject_set_text(set));
}

std::vector<Subject> draw_subjects(std::size_t count, std::uint64_t seed,
                                   const simulation::OperatorModel& common, const HandRanges& ranges) {
  if (count == 0 || count > 10'000)
    throw std::invalid_argument(fmt::format("{} subjects: allowed is 1 to 10000", count));
  // The engine's numbers are fixed by the standard, those of its distributions are not.
  std::mt19937_64 random(seed);
  const auto between = [&random](const DrawnRange& range) {
    const double share = static_cast<double>(random() >> 11) * 0x1.0p-53;
    return range.least * std::pow(range.most / range.least, share);
  };
  std::vector<Subject> subjects;
  for (std::size_t n = 0; n < count; ++n) {
    Subject subject{fmt::format("drawn {}", n + 1), common};
    subject.person.grip_stiffness = between(ranges.grip_stiffness);
    subject.person.grip_damping = between(ranges.grip_damping);
    subject.person.hand_mass = between(ranges.hand_mass);
    subject.person.arm_stiffness = between(ranges.arm_stiffness);
    subject.person.arm_damping = between(ranges.arm_damping);
    subjects.push_back(std::move(subject));
  }
  return subjects;
}

}  // namespace kmax::experiment
