#include "host_tools/experiment/touch_changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "firmware/drive/axis_configuration.hpp"
#include "firmware/parameters/parameter_rules.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/simulated_board/setting_names.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::experiment {
namespace {

using Loop = control::HapticLoopConfig<float>;
using simulation::SceneAxis;

constexpr std::string_view parameters_prefix = "parameters.";

/// A parameter that may be changed, and what of the loop it is.
struct ChangeableParameter {
  std::string_view name;
  void (*copy)(Loop& to, const Loop& from);
  bool of_papers_walls = false;  ///< which differ by it
};

constexpr auto copy_adaptive = [](Loop& to, const Loop& from) {
  const control::AdaptiveMode mode = to.wall.adaptive.mode;
  to.wall.adaptive = from.wall.adaptive;
  to.wall.adaptive.mode = mode;
};
// What is calm is judged by the velocity: see wall.damping.
constexpr auto copy_growing = [](Loop& to, const Loop& from) {
  to.wall.growing = from.wall.growing;
  to.velocity = from.velocity;
};
constexpr auto copy_velocity = [](Loop& to, const Loop& from) { to.velocity = from.velocity; };

constexpr std::array changeable_parameters{
    ChangeableParameter{"haptic.rate",
                        [](Loop& to, const Loop& from) { to.tick_rate = from.tick_rate / from.divider; }},
    // A wall without damping needs no velocity, and may have been given an estimator that costs nothing.
    ChangeableParameter{"wall.damping",
                        [](Loop& to, const Loop& from) {
                          to.wall.damping = from.wall.damping;
                          to.velocity = from.velocity;
                        }},
    ChangeableParameter{"wall.damping_window",
                        [](Loop& to, const Loop& from) { to.damping_window = from.damping_window; }},
    ChangeableParameter{"wall.touch_stiffness", copy_growing},
    ChangeableParameter{"wall.growth_time", copy_growing},
    ChangeableParameter{"wall.calm_velocity", copy_growing},
    ChangeableParameter{
        "wall.magnetic_length",
        [](Loop& to, const Loop& from) { to.wall.magnetic_length = from.wall.magnetic_length; }},
    ChangeableParameter{"wall.adaptive_gain", copy_adaptive},
    ChangeableParameter{"wall.adaptive_offset", copy_adaptive},
    ChangeableParameter{"wall.adaptive_velocity_max", copy_adaptive},
    ChangeableParameter{"wall.adaptive_force_min", copy_adaptive},
    ChangeableParameter{"wall.adaptive_force_max", copy_adaptive},
    ChangeableParameter{"wall.adaptive_hold_time", copy_adaptive},
    ChangeableParameter{"wall.adaptive_relation", copy_adaptive},
    ChangeableParameter{"wall.adaptive_velocity", copy_adaptive},
    ChangeableParameter{"velocity.estimator", copy_velocity},
    ChangeableParameter{"velocity.window", copy_velocity},
    ChangeableParameter{"velocity.bandwidth", copy_velocity},
    ChangeableParameter{
        "position.resolution",
        [](Loop& to, const Loop& from) { to.position_resolution = from.position_resolution; }},
    ChangeableParameter{"position.rounding",
                        [](Loop& to, const Loop& from) { to.position_rounding = from.position_rounding; }},
    ChangeableParameter{"force.slew_limit",
                        [](Loop& to, const Loop& from) { to.force.slew_limit = from.force.slew_limit; }},
    ChangeableParameter{"wall.law", [](Loop& to, const Loop& from) { to.wall.kind = from.wall.kind; }, true},
    ChangeableParameter{
        "wall.magnetic_coefficient",
        [](Loop& to, const Loop& from) { to.wall.magnetic_coefficient = from.wall.magnetic_coefficient; },
        true},
    ChangeableParameter{"wall.adaptive_mode",
                        [](Loop& to, const Loop& from) { to.wall.adaptive.mode = from.wall.adaptive.mode; },
                        true},
};

/// What a name is left alone for, and what changes it instead.
struct Reserved {
  std::string_view name, why;
};
constexpr std::array reserved{
    Reserved{"wall.stiffness", "the experiment sets it: see --stiffness or --start, --step and --last"},
    Reserved{"wall.law", "it is what the experiment compares: see --conditions, where there are some"},
    Reserved{"wall.magnetic_coefficient",
             "it is what the experiment compares: see --conditions, where there are some"},
    Reserved{"wall.adaptive_mode",
             "it is what the experiment compares: see --conditions, where there are some"},
    Reserved{"device.force_limit", "of simulated people --clip says it; a device has --force-limit"},
    Reserved{"force.limit", "of simulated people --clip says it; a device has --force-limit"},
    Reserved{"motion.approach_speed", "every stiffness is touched at several speeds"},
    Reserved{"motion.push_force", "every stiffness is touched with several pushes"},
    Reserved{"measurement.threshold", "see --threshold"},
};

/// Calls `take(member, name)` for each number of what is simulated that may be changed.
template <typename Take>
void for_each_number(Touching touching, Varied varied, const Take& take) {
  if (touching == Touching::device) return;
  for (const auto& field : simulation::device_fields) {
    if (std::string_view(field.name) != "force_limit")
      take(
          fmt::format("device.{}", field.name), [&field](auto& axis) -> auto& {
            return axis.device.*field.member;
          });
  }
  for (const auto& field : simulation::structure_fields)
    take(
        fmt::format("structure.{}", field.name), [&field](auto& axis) -> auto& {
          return (*axis.device.structure).*field.member;
        });
  for (const auto& field : simulation::operator_fields)
    take(
        fmt::format("operator.{}", field.name), [&field](auto& axis) -> auto& {
          return (*axis.person).*field.member;
        });
  for (const auto& field : simulation::motion_fields) {
    const std::string_view name = field.name;
    const bool of_one_person =
        (name == "approach_speed" && varied == Varied::papers_walls) || name == "push_force";
    if (name == "start_position" || (of_one_person && touching == Touching::simulated_person))
      take(
          fmt::format("motion.{}", name), [&field](auto& axis) -> auto& {
            return (*axis.motion).*field.member;
          });
  }
  take(
      "encoder.counts_per_turn", [](auto& axis) -> auto& { return axis.encoder.counts_per_turn; });
}

std::vector<std::string> names_of(Touching touching, Varied varied) {
  std::vector<std::string> names;
  for (const ChangeableParameter& one : changeable_parameters) {
    if (!one.of_papers_walls || varied != Varied::papers_walls) names.emplace_back(one.name);
  }
  for_each_number(touching, varied, [&](const std::string& name, const auto&) { names.push_back(name); });
  return names;
}

bool is_one_of(const std::string& name, const std::vector<std::string>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

[[noreturn]] void refuse(const std::string& name, bool parameter, Touching touching, Varied varied) {
  const auto* known =
      std::find_if(reserved.begin(), reserved.end(), [&](const Reserved& one) { return one.name == name; });
  if (known != reserved.end())
    throw base::ValueError(fmt::format("--set {}: not to be changed here; {}", name, known->why));
  if (!parameter && is_one_of(name, names_of(Touching::simulated_person, varied)))
    throw base::ValueError(fmt::format(
        "--set {}: it is simulated, and the device that --device names is as it is; leave one of them out",
        name));
  throw base::ValueError(fmt::format("--set {}: no touch of this experiment goes by it; allowed are {}", name,
                                     fmt::join(names_of(touching, varied), ", ")));
}

/// The supplied scene of one person at a wall; with a structure where one is asked for.
std::string scene_text(bool structure) {
  for (const simulated_board::SuppliedScene& scene : simulated_board::supplied_scenes()) {
    if (scene.name == "touch") return std::string(scene.text) + (structure ? "\n[structure]\n" : "");
  }
  throw std::logic_error("no supplied scene 'touch'");
}

bool of_structure(const simulation::SceneSetting& setting) {
  return setting.name.starts_with("structure.");
}

}  // namespace

TouchChanges::TouchChanges(const std::vector<std::string>& texts, Touching touching, Varied varied) {
  const std::vector<std::string> allowed = names_of(touching, varied);
  for (simulation::SceneSetting& setting : simulated_board::parse_settings(texts)) {
    const bool parameter = setting.name.starts_with(parameters_prefix);
    if (parameter) setting.name.erase(0, parameters_prefix.size());
    const bool of_firmware =
        std::any_of(changeable_parameters.begin(), changeable_parameters.end(),
                    [&](const ChangeableParameter& one) { return one.name == setting.name; });
    if (!is_one_of(setting.name, allowed) || parameter != of_firmware)
      refuse(setting.name, parameter, touching, varied);
    (parameter ? of_parameters_ : of_scene_).push_back(std::move(setting));
  }
  if (!empty()) read();
}

void TouchChanges::read() {
  std::vector<simulation::SceneSetting> all = of_scene_;
  for (const simulation::SceneSetting& one : of_parameters_)
    all.push_back({std::string(parameters_prefix) + one.name, one.value});
  scene_ = simulation::parse_scene(scene_text(std::any_of(of_scene_.begin(), of_scene_.end(), of_structure)),
                                   "--set", simulated_board::check_parameter, all);
  firmware::ParameterValues values;
  for (const device::Assignment& one : simulated_board::own_assignments_of(scene_)) {
    if (changes(one.parameter.name())) values.set_raw(one.parameter.slot(), one.raw);
  }
  if (const auto broken = firmware::check_rules(values); broken.refusal != firmware::Refusal::none)
    throw base::ValueError(fmt::format("--set: {}", firmware::to_string(broken.refusal)));
  loop_ = firmware::haptic_configuration(values, 0);
  scene_.parameters.clear();
}

bool TouchChanges::changes(std::string_view name) const {
  const auto is_it = [&](const simulation::SceneSetting& one) { return one.name == name; };
  return std::any_of(of_parameters_.begin(), of_parameters_.end(), is_it) ||
         std::any_of(of_scene_.begin(), of_scene_.end(), is_it);
}

std::vector<std::string> TouchChanges::assignments() const {
  std::vector<std::string> all;
  for (const auto& one : of_parameters_) all.push_back(fmt::format("{}={}", one.name, one.value));
  return all;
}

std::vector<std::string> TouchChanges::words() const {
  std::vector<std::string> all = assignments();
  for (const auto& one : of_scene_) all.push_back(fmt::format("{}={}", one.name, one.value));
  return all;
}

std::string TouchChanges::sentence() const {
  if (empty()) return {};
  return fmt::format("Changed for every touch: {}.", fmt::join(words(), ", "));
}

std::optional<double> TouchChanges::haptic_rate() const {
  if (!changes("haptic.rate")) return std::nullopt;
  return loop_.tick_rate / loop_.divider;
}

void TouchChanges::apply(TouchSetup& setup) const {
  for (const ChangeableParameter& one : changeable_parameters) {
    if (changes(one.name)) one.copy(setup.wall, loop_);
  }
  if (of_scene_.empty()) return;
  const SceneAxis& from = scene_.axes.front();
  SceneAxis to;
  to.device = setup.device;
  to.person = setup.person;
  to.motion = setup.motion;
  if (from.device.structure && !to.device.structure) to.device.structure = from.device.structure;
  for_each_number(Touching::simulated_person, Varied::papers_walls,
                  [&](const std::string& name, const auto& member) {
                    if (changes(name)) member(to) = member(from);
                  });
  setup.device = to.device;
  setup.person = *to.person;
  setup.motion = *to.motion;
  if (changes("encoder.counts_per_turn")) setup.wall.count_length = from.encoder.count_length();
}

simulation::Scene TouchChanges::simulated_device() const {
  return empty() ? simulated_board::factory_scene() : scene_;
}

std::string changeable_names(Touching touching) {
  return fmt::format("{}", fmt::join(names_of(touching, Varied::papers_walls), ", "));
}

}  // namespace kmax::experiment
