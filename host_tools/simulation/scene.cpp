#include "host_tools/simulation/scene.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "host_tools/simulation/scene_axis.hpp"
#include "host_tools/simulation/scene_table.hpp"

namespace kmax::simulation {
namespace {

constexpr std::array measurement_fields{
    ModelField<Measurement>{"window", &Measurement::window, 1e-3, 1e5, "s"},
    ModelField<Measurement>{"threshold", &Measurement::threshold, 1e-9, 1.0, "m"},
};
constexpr std::array scene_fields{ModelField<Scene>{"duration", &Scene::duration, 1e-3, 1e5, "s"}};

class SceneReader : private SceneTables {
 public:
  SceneReader(std::string_view source, const ParameterCheck& check) : SceneTables(source), check_(check) {}

  Scene read(const toml::table& root) {
    require_known(root, "",
                  {"name", "description", "duration", "seed", "identified", "device", "operator", "motion",
                   "encoder", "parameters", "measurement", "structure", "motor", "inverter", "current_sensor",
                   "supply", "integrator", "axis1"});
    Scene scene;
    scene.name = std::filesystem::path(source()).stem().string();
    read_text(root, "name", scene.name);
    read_text(root, "description", scene.description);
    read_fields(root, "", scene_fields, scene);
    read_seed(root, scene);
    read_truth(root, "", "identified", scene.identified);
    if (const toml::table* table = part(root, "", "measurement")) {
      require_known(*table, "measurement.", {"window", "threshold"});
      read_fields(*table, "measurement.", measurement_fields, scene.measurement);
    }
    if (const toml::table* table = part(root, "", "parameters")) read_parameters(*table, "", scene);
    scene.axes.push_back(read_axis(root, "", scene));
    if (const toml::table* second = part(root, "", "axis1")) {
      require_known(
          *second, "axis1.",
          {"device", "structure", "operator", "motion", "encoder", "motor", "inverter", "current_sensor"});
      scene.axes.push_back(read_axis(*second, "axis1.", scene));
    }
    read_supply_table(*this, root, scene);
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
    const bool second = !scene.axes.empty();
    const std::initializer_list<std::string_view> others{"same_person"};
    read_model(table, prefix + "operator.", operator_fields, axis.person.emplace(),
               second ? others : std::initializer_list<std::string_view>{});
    if (!second) return;
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
    read_model(table, prefix + "motion.", motion_fields, motion);
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

  // Axis 0 need not be named: `axis0.wall.position` and `wall.position` are one parameter.
  static std::string_view without_axis_0(std::string_view name) {
    constexpr std::string_view axis = "axis0.";
    return name.starts_with(axis) ? name.substr(axis.size()) : name;
  }

  static const SceneParameter* find_parameter(const Scene& scene, const std::string& prefix,
                                              std::string_view name) {
    for (const SceneParameter& parameter : scene.parameters) {
      if (without_axis_0(parameter.name) == prefix + std::string(name)) return &parameter;
    }
    return nullptr;
  }

  static std::optional<double> number_in(const SceneParameter* parameter) {
    if (parameter == nullptr) return std::nullopt;
    if (const auto* whole = std::get_if<std::int64_t>(&parameter->value)) return static_cast<double>(*whole);
    if (const auto* number = std::get_if<double>(&parameter->value)) return *number;
    return std::nullopt;
  }

  static void read_wall(const toml::table& table, const std::string& prefix, const Scene& scene,
                        std::string_view parameter, std::string_view key, double& value) {
    if (table.contains(key)) return;
    value = number_in(find_parameter(scene, prefix, parameter)).value_or(value);
  }

  void check_wall(const toml::table& table, const std::string& prefix, const Scene& scene,
                  std::string_view name, std::string_view key, double value) const {
    const SceneParameter* parameter = find_parameter(scene, prefix, name);
    const std::optional<double> wall = number_in(parameter);
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
        if (without_axis_0(earlier.name) == without_axis_0(name)) {
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

Scene parse_scene(std::string_view text, std::string_view source, const ParameterCheck& check) {
  return SceneReader(source, check).read(parsed_toml(text, source));
}

Scene load_scene(const std::string& path, const ParameterCheck& check) {
  return parse_scene(text_of_file(path, "a scene file"), path, check);
}

std::string to_string(const IntegratorConfig& integrator) {
  const std::string_view name = integrator_names[static_cast<std::size_t>(integrator.kind)];
  switch (integrator.kind) {
    case IntegratorKind::exact:
      break;
    case IntegratorKind::semi_implicit_euler:
    case IntegratorKind::rk4:
      return fmt::format("{}, {} substeps per 2 ms", name, integrator.substeps);
    case IntegratorKind::adaptive:
      return fmt::format("{}, tolerance {}", name, integrator.tolerance);
  }
  return std::string(name);
}

std::vector<std::string> integrated_parts(const SceneAxis& axis) {
  std::vector<std::string> parts;
  if (axis.motor) {
    const bool brushed = std::holds_alternative<BrushedDcMotorConfig>(*axis.motor);
    parts.emplace_back(brushed ? "DC motor" : "synchronous motor");
    parts.emplace_back("inverter");
    parts.emplace_back("supply");
  }
  parts.emplace_back("device");
  if (axis.device.delay > 0.0) parts.push_back(fmt::format("delay of {} ms", axis.device.delay * 1e3));
  if (axis.device.structure) parts.emplace_back("structure");
  if (axis.person) parts.emplace_back("hand and arm");
  if (axis.person && axis.person->activation_gain > 0.0) parts.emplace_back("activation");
  if (axis.encoder.edge_noise > 0.0) parts.emplace_back("encoder noise");
  if (axis.encoder.dropout_probability > 0.0) parts.emplace_back("encoder dropouts");
  return parts;
}

}  // namespace kmax::simulation
