#include "host_tools/simulation/scene.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "firmware/object_dictionary/entry.hpp"
#include "host_tools/base/axis_name.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/toml_text.hpp"
#include "host_tools/simulation/scene_keys.hpp"
#include "host_tools/simulation/scene_settings.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::simulation {
namespace {

// The numbers of [name], whose keys are those that scene_keys() lists. `motor`: the kind of a [motor].
template <typename Model, std::size_t count>
void read_numbers(const SceneTables& tables, const toml::table& table, const std::string& axis,
                  std::string_view name, const std::array<ModelField<Model>, count>& fields, Model& model,
                  std::string_view motor = "") {
  const std::string prefix = fmt::format("{}{}.", axis, name);
  tables.require_known(table, prefix, key_names(name, motor));
  tables.read_fields(table, prefix, fields, model);
}

const toml::table& device_of(const SceneTables& tables, const toml::table& table, const std::string& prefix) {
  const toml::table* device = tables.part(table, prefix, "device");
  if (device == nullptr)
    tables.fail(table.source(), fmt::format("[{}device] is missing: every axis needs a device", prefix));
  return *device;
}

// A number that the kind of integrator does not go by.
void refuse_unused(const SceneTables& tables, const toml::table& table, std::string_view key,
                   std::string_view kind, std::string_view used_by) {
  const toml::node* node = table.get(key);
  if (node == nullptr) return;
  tables.fail(node->source(), fmt::format("integrator.{} = {}: integrator.kind is \"{}\", which has none; "
                                          "allowed is that with kind = {}",
                                          key, SceneTables::text_of(*node), kind, used_by));
}

// `table`: the one that holds the tables of the axis; `prefix`: "" or "axis1.".
void read_device_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis) {
  read_numbers(tables, device_of(tables, table, prefix), prefix, "device", device_fields, axis.device);
  if (const toml::table* structure = tables.part(table, prefix, "structure")) {
    read_numbers(tables, *structure, prefix, "structure", structure_fields, axis.device.structure.emplace());
  }
}

// Where the handle begins: what [device] says, and otherwise what is in the axis already.
void read_start(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                SceneAxis& axis) {
  tables.read_fields(device_of(tables, table, prefix), prefix + "device.", start_fields, axis.start);
}

// What the device and the other parts of the axis contradict each other in; when all have been read.
void check_device(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                  const SceneAxis& axis) {
  if (!axis.motor || axis.device.delay == 0.0) return;
  const toml::node& node = *device_of(tables, table, prefix).get("delay");
  tables.fail(
      node.source(),
      fmt::format("{0}device.delay = {1}: with this [{0}motor] the circuit makes the delay; allowed is "
                  "0 there, or a delay with [{0}motor] kind = \"ideal\"",
                  prefix, SceneTables::text_of(node)));
}

void read_integrator_table(const SceneTables& tables, const toml::table& root, Scene& scene) {
  const toml::table* table = tables.part(root, "", "integrator");
  if (table == nullptr) return;
  IntegratorConfig& integrator = scene.integrator;
  read_numbers(tables, *table, "", "integrator", integrator_fields, integrator);
  if (const auto kind = tables.read_choice(*table, "integrator.", "kind", integrator_names))
    integrator.kind = static_cast<IntegratorKind>(*kind);
  const std::string_view name = integrator_names[static_cast<std::size_t>(integrator.kind)];
  const bool stepped =
      integrator.kind == IntegratorKind::semi_implicit_euler || integrator.kind == IntegratorKind::rk4;
  if (!stepped) refuse_unused(tables, *table, "substeps", name, "\"semi_implicit_euler\" or \"rk4\"");
  if (integrator.kind != IntegratorKind::adaptive)
    refuse_unused(tables, *table, "tolerance", name, "\"adaptive\"");
}

// What only the whole model can tell, with the axis in front and the table's place.
template <typename Model>
void require_valid(const SceneTables& tables, const toml::table& table, const std::string& axis,
                   const Model& model) {
  try {
    validate(model);
  } catch (const std::invalid_argument& error) {
    tables.fail(table.source(), axis + error.what());
  }
}

SynchronousMotorConfig read_synchronous(const SceneTables& tables, const toml::table& table,
                                        const std::string& axis) {
  const std::string prefix = axis + "motor.";
  SynchronousMotorConfig config;
  if (const toml::node* both = table.get("inductance")) {
    for (const char* one : {"inductance_d", "inductance_q"}) {
      if (!table.contains(one)) continue;
      tables.fail(
          both->source(),
          fmt::format("{0}inductance = {1}: {0}{2} is given too; allowed is inductance, or inductance_d "
                      "and inductance_q",
                      prefix, SceneTables::text_of(*both), one));
    }
    BothInductances same;
    tables.read_fields(table, prefix, both_inductances_fields, same);
    config.inductance_d = config.inductance_q = same.inductance;
  }
  read_numbers(tables, table, axis, "motor", synchronous_motor_fields, config, "pmsm");
  require_valid(tables, table, axis, config);
  return config;
}

void read_defects(const SceneTables& tables, const toml::table& motor, const std::string& prefix,
                  SceneAxis& axis) {
  const toml::node* node = motor.get("defects");
  if (node == nullptr) return;
  const auto refuse = [&](const toml::node& what) {
    std::string names;
    for (const DefectName& one : defect_names)
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", one.name);
    tables.fail(what.source(), fmt::format("{}motor.defects = {}: allowed is a list of {}", prefix,
                                           SceneTables::text_of(what), names));
  };
  if (!node->is_array()) refuse(*node);
  for (const toml::node& one : *node->as_array()) {
    const auto defect = one.is_string() ? defect_named(one.as_string()->get()) : std::nullopt;
    if (!defect) refuse(one);
    axis.defects.push_back(*defect);
  }
}

// An ideal motor is what an axis without the table has; only to say so.
void read_ideal_motor(const SceneTables& tables, const toml::table& motor, const std::string& prefix) {
  if (const toml::node* defects = motor.get("defects")) {
    tables.fail(defects->source(),
                fmt::format("{0}motor.defects = {1}: an ideal motor has nothing that could break; allowed is "
                            "{0}motor.kind = \"dc\" or \"pmsm\", or no defects",
                            prefix, SceneTables::text_of(*defects)));
  }
  tables.require_known(motor, prefix + "motor.", {"kind"});
}

// A number of the encoder that only a motor's has: refused unless it is its default.
void require_plain_encoder(const SceneTables& tables, const toml::table& encoder, const std::string& prefix,
                           const EncoderConfig& config) {
  const auto refuse = [&](std::string_view key, std::string_view what) {
    const toml::node& node = *encoder.get(key);
    tables.fail(node.source(),
                fmt::format("{0}encoder.{1} = {2}: {3} belongs to a motor's encoder; allowed is that with "
                            "[{0}motor] kind = \"dc\" or \"pmsm\"",
                            prefix, key, SceneTables::text_of(node), what));
  };
  if (config.kind != EncoderKind::quadrature) refuse("kind", "this chip");
  if (config.reversed) refuse("reversed", "how it is mounted");
  if (config.index_position != 0.0) refuse("index_position", "an index");
}

// After the motor: it needs to know whether there is one.
void read_encoder_table(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis) {
  const toml::table* encoder = tables.part(table, prefix, "encoder");
  if (encoder == nullptr) return;
  read_numbers(tables, *encoder, prefix, "encoder", encoder_fields, axis.encoder);
  tables.read_truth(*encoder, prefix + "encoder.", "reversed", axis.encoder.reversed);
  tables.read_truth(*encoder, prefix + "encoder.", "select_filtered", axis.encoder.select_filtered);
  const auto kind = tables.read_choice(*encoder, prefix + "encoder.", "kind", encoder_kinds);
  if (kind) axis.encoder.kind = static_cast<EncoderKind>(*kind);
  if (!axis.encoder.select_filtered && axis.encoder.kind != EncoderKind::as5047p)
    tables.fail(
        encoder->get("select_filtered")->source(),
        fmt::format("{0}encoder.select_filtered = false: only an AS5047P has a select; allowed is that "
                    "with {0}encoder.kind = \"as5047p\"",
                    prefix));
  if (!(axis.encoder.count_length() >= 1e-12)) {
    tables.fail(encoder->source(), fmt::format("{}encoder: {} m per count; allowed is 1e-12 m or more",
                                               prefix, axis.encoder.count_length()));
  }
  if (!axis.motor) require_plain_encoder(tables, *encoder, prefix, axis.encoder);
  // An ideal encoder without lines counts in any unit.
  if (axis.motor || has_defects(axis.encoder)) require_valid(tables, *encoder, prefix, axis.encoder);
}

void read_motor_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                       SceneAxis& axis) {
  const toml::table* motor = tables.part(table, prefix, "motor");
  const toml::table* inverter = tables.part(table, prefix, "inverter");
  const toml::table* sensor = tables.part(table, prefix, "current_sensor");
  if (motor != nullptr) {
    const auto kind = tables.read_choice(*motor, prefix + "motor.", "kind", motor_kinds);
    if (!kind) {
      tables.fail(motor->source(), fmt::format("{}motor.kind is missing; allowed is {}", prefix,
                                               SceneTables::one_of(motor_kinds)));
    }
    if (motor_kinds[*kind] == "ideal") {
      read_ideal_motor(tables, *motor, prefix);
    } else if (motor_kinds[*kind] == "pmsm") {
      axis.motor = read_synchronous(tables, *motor, prefix);
    } else {
      BrushedDcMotorConfig config;
      read_numbers(tables, *motor, prefix, "motor", brushed_dc_motor_fields, config, "dc");
      axis.motor = config;
    }
  }
  if (!axis.motor) {
    const toml::table* lonely = inverter != nullptr ? inverter : sensor;
    if (lonely == nullptr) return;
    tables.fail(lonely->source(),
                fmt::format("[{0}{1}] without a [{0}motor] of kind \"dc\" or \"pmsm\": there is no current; "
                            "add the motor, or remove the table",
                            prefix, inverter != nullptr ? "inverter" : "current_sensor"));
  }
  read_defects(tables, *motor, prefix, axis);
  if (inverter != nullptr)
    read_numbers(tables, *inverter, prefix, "inverter", inverter_fields, axis.inverter);
  if (sensor != nullptr)
    read_numbers(tables, *sensor, prefix, "current_sensor", current_sensor_fields, axis.current_sensor);
}

void read_supply_table(const SceneTables& tables, const toml::table& root, Scene& scene) {
  const toml::table* supply = tables.part(root, "", "supply");
  if (supply == nullptr) return;
  SupplyConfig& config = scene.supply.emplace();
  read_numbers(tables, *supply, "", "supply", supply_fields, config);
  tables.read_truth(*supply, "supply.", "absorbs", config.absorbs);
  tables.read_truth(*supply, "supply.", "part_ratings", config.part_ratings);
}

void read_spikes_table(const SceneTables& tables, const toml::table& root, Scene& scene) {
  const toml::table* table = tables.part(root, "", "spikes");
  if (table == nullptr) return;
  SpikesConfig& spikes = scene.spikes.emplace();
  const std::pair<const char*, bool*> truths[] = {{"at_samples", &spikes.at_samples},
                                                  {"index", &spikes.index},
                                                  {"emergency_stop", &spikes.emergency_stop},
                                                  {"fault_line", &spikes.fault_line},
                                                  {"encoder", &spikes.encoder}};
  read_numbers(tables, *table, "", "spikes", spikes_fields, spikes);
  for (const auto& [name, value] : truths) tables.read_truth(*table, "spikes.", name, *value);
}

class SceneReader : private SceneTables {
 public:
  SceneReader(std::string_view source, const ParameterCheck& check) : SceneTables(source), check_(check) {}

  Scene read(const toml::table& root) {
    std::vector<std::string> further_axes;  // without a gap
    for (std::size_t axis = 1; axis < firmware::axis_count; ++axis) {
      if (axis > 1 && !root.contains(further_axes.back())) break;
      further_axes.push_back(fmt::format("axis{}", axis));
    }
    std::vector<std::string_view> known = key_names("");
    std::vector<std::string_view> of_further_axes;
    for (const SceneTable& table : scene_tables) {
      if (!table.name.empty()) known.push_back(table.name);
      if (table.of_axis) of_further_axes.push_back(table.name);
    }
    known.insert(known.end(), further_axes.begin(), further_axes.end());
    require_known(root, "", known);
    Scene scene;
    scene.name = std::filesystem::path(source()).stem().string();
    read_text(root, "name", scene.name);
    read_text(root, "description", scene.description);
    read_fields(root, "", scene_fields, scene);
    read_seed(root, scene);
    read_truth(root, "", "identified", scene.identified);
    if (const toml::table* table = part(root, "", "measurement")) {
      read_numbers(*this, *table, "", "measurement", measurement_fields, scene.measurement);
    }
    if (const toml::table* table = part(root, "", "parameters")) read_parameters(*table, "", scene);
    scene.axes.push_back(read_axis(root, "", scene));
    for (const std::string& name : further_axes) {
      const toml::table* table = part(root, "", name);
      if (table == nullptr) continue;
      require_known(*table, name + ".", of_further_axes);
      scene.axes.push_back(read_axis(*table, name + ".", scene));
    }
    read_supply_table(*this, root, scene);
    read_spikes_table(*this, root, scene);
    read_integrator_table(*this, root, scene);
    return scene;
  }

 private:
  void read_seed(const toml::table& table, Scene& scene) const {
    const toml::node* node = table.get("seed");
    if (node == nullptr) return;
    if (!node->is_integer() || node->as_integer()->get() < 0) {
      fail(node->source(),
           fmt::format("seed = {}: allowed is a whole number from 0 to 2^63 - 1", text_of(*node)));
    }
    scene.seed = static_cast<std::uint64_t>(node->as_integer()->get());
  }

  SceneAxis read_axis(const toml::table& table, const std::string& prefix, const Scene& scene) const {
    SceneAxis axis;
    read_device_tables(*this, table, prefix, axis);
    if (const toml::table* person = part(table, prefix, "operator"))
      read_operator(*person, prefix, scene, axis);
    read_motor_tables(*this, table, prefix, axis);
    read_encoder_table(*this, table, prefix, axis);
    if (const toml::table* motion = part(table, prefix, "motion")) {
      read_motion(*motion, prefix, scene, axis);
      axis.start.position = axis.motion->start_position;
    }
    read_start(*this, table, prefix, axis);
    check_device(*this, table, prefix, axis);
    if (axis.same_person && (axis.motor || scene.axes.front().motor)) {
      fail(
          table.get("operator")->as_table()->get("same_person")->source(),
          fmt::format("{}operator.same_person = true: allowed is that where neither axis has a motor of kind "
                      "\"dc\" or \"pmsm\"",
                      prefix));
    }
    return axis;
  }

  void read_operator(const toml::table& table, const std::string& prefix, const Scene& scene,
                     SceneAxis& axis) const {
    const bool first = scene.axes.empty();
    std::vector<std::string_view> known = key_names("operator");
    if (first) std::erase(known, "same_person");
    require_known(table, prefix + "operator.", known);
    read_fields(table, prefix + "operator.", operator_fields, axis.person.emplace());
    if (first) return;
    read_truth(table, prefix + "operator.", "same_person", axis.same_person);
    if (axis.same_person && !scene.axes.front().person) {
      fail(table.get("same_person")->source(),
           fmt::format(
               "{}operator.same_person = true: nobody holds axis 0; allowed is that with an [operator]",
               prefix));
    }
  }

  void read_motion(const toml::table& table, const std::string& prefix, const Scene& scene,
                   SceneAxis& axis) const {
    if (!axis.person) {
      fail(table.source(),
           fmt::format("[{0}motion] without [{0}operator]: nobody is there to move the handle", prefix));
    }
    IntendedMotionConfig& motion = axis.motion.emplace();
    read_wall(table, prefix, scene, "wall.position", "wall_position", motion.wall_position);
    read_wall(table, prefix, scene, "wall.side", "wall_side", motion.wall_side);
    read_numbers(*this, table, prefix, "motion", motion_fields, motion);
    check_wall(table, prefix, scene, "wall.position", "wall_position", motion.wall_position);
    check_wall(table, prefix, scene, "wall.side", "wall_side", motion.wall_side);
    try {
      validate(motion);
    } catch (const std::invalid_argument& error) {
      fail(table.source(), prefix + error.what());
    }
    if (scene.measurement.window > motion.hold_time) {
      fail(table.source(),
           fmt::format("{}motion.hold_time = {} s: allowed is {} s (measurement.window) or more", prefix,
                       motion.hold_time, scene.measurement.window));
    }
    const double shortest =
        std::abs(motion.start_position - motion.wall_position) / motion.approach_speed + motion.hold_time;
    if (scene.duration < shortest) {
      fail(table.source(),
           fmt::format("duration = {} s: approach and hold of [{}motion] take at least {} s; allowed is "
                       "that or more",
                       scene.duration, prefix, shortest));
    }
  }

  static const SceneParameter* find_parameter(const Scene& scene, const std::string& prefix,
                                              std::string_view name) {
    for (const SceneParameter& parameter : scene.parameters) {
      if (base::without_axis_0(parameter.name) == prefix + std::string(name)) return &parameter;
    }
    return nullptr;
  }

  static std::optional<double> number_in(const SceneParameter* parameter, std::string_view unit) {
    if (parameter == nullptr) return std::nullopt;
    if (const auto* whole = std::get_if<std::int64_t>(&parameter->value)) return static_cast<double>(*whole);
    if (const auto* number = std::get_if<double>(&parameter->value)) return *number;
    const auto* text = std::get_if<std::string>(&parameter->value);
    if (text == nullptr) return std::nullopt;
    try {
      return base::written_number(*text, unit, "a number", "a number").value;
    } catch (const base::ValueError&) {
      return std::nullopt;  // the caller's check has its own words for it
    }
  }

  static void read_wall(const toml::table& table, const std::string& prefix, const Scene& scene,
                        std::string_view parameter, std::string_view key, double& value) {
    if (table.contains(key)) return;
    const std::string_view unit = find_scene_key("motion", key)->unit;
    value = number_in(find_parameter(scene, prefix, parameter), unit).value_or(value);
  }

  void check_wall(const toml::table& table, const std::string& prefix, const Scene& scene,
                  std::string_view name, std::string_view key, double value) const {
    const SceneParameter* parameter = find_parameter(scene, prefix, name);
    const std::optional<double> wall = number_in(parameter, find_scene_key("motion", key)->unit);
    const toml::node* node = table.get(key);
    if (!wall || *wall == value || node == nullptr) return;
    fail(node->source(),
         fmt::format("{}motion.{} = {}: the parameter {} is {} ({}); allowed is the same value, or none here",
                     prefix, key, value, parameter->name, *wall, parameter->where));
  }

  void read_parameters(const toml::table& table, const std::string& prefix, Scene& scene) const {
    for (const auto& [key, node] : table) {
      const std::string name = prefix + std::string(key.str());
      if (const toml::table* inner = node.as_table()) {
        read_parameters(*inner, name + ".", scene);
        continue;
      }
      SceneParameter parameter{name, {}, place(node.source())};
      if (const auto* truth = node.as_boolean()) {
        parameter.value = truth->get();
      } else if (const auto* whole = node.as_integer()) {
        parameter.value = whole->get();
      } else if (const auto* number = node.as_floating_point()) {
        parameter.value = number->get();
      } else if (const auto* text = node.as_string()) {
        parameter.value = text->get();
      } else {
        fail(node.source(), fmt::format("parameters.{} = {}: allowed is a number, a text or true/false", name,
                                        text_of(node)));
      }
      for (const SceneParameter& earlier : scene.parameters) {
        if (base::without_axis_0(earlier.name) == base::without_axis_0(name)) {
          fail(node.source(),
               fmt::format("parameters.{} = {}: given twice (also at {}{}); remove one", name, text_of(node),
                           earlier.where, earlier.name == name ? "" : ", as " + earlier.name));
        }
      }
      if (check_) {
        if (const std::optional<std::string> problem = check_(name, parameter.value)) {
          fail(node.source(), fmt::format("parameters.{} = {}: {}", name, text_of(node), *problem));
        }
      }
      scene.parameters.push_back(std::move(parameter));
    }
  }

  const ParameterCheck& check_;
};

}  // namespace

Scene parse_scene(std::string_view text, std::string_view source, const ParameterCheck& check,
                  std::span<const SceneSetting> settings) {
  toml::table root = base::parsed_toml<SceneError>(text, source);
  put_settings(root, settings, source);
  return SceneReader(source, check).read(root);
}

Scene load_scene(const std::string& path, const ParameterCheck& check,
                 std::span<const SceneSetting> settings) {
  return parse_scene(base::text_of<SceneError>(path, "give the path of a scene file (TOML)"), path, check,
                     settings);
}

}  // namespace kmax::simulation
