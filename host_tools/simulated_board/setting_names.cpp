#include "host_tools/simulated_board/setting_names.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/axis_name.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/simulation/scene_keys.hpp"

namespace kmax::simulated_board {

namespace {
using simulation::SceneKey;
using simulation::SceneValue;

constexpr std::string_view parameters_prefix = "parameters.";

const SceneKey* scene_key(std::string_view name, bool on_axis) {
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos) return on_axis ? nullptr : simulation::find_scene_key("", name);
  const auto* table = simulation::scene_table_named(name.substr(0, dot));
  if (table == nullptr || (on_axis && !table->of_axis)) return nullptr;
  return simulation::find_scene_key(table->name, name.substr(dot + 1));
}

NamedSetting parameter_setting(std::string_view name) {
  const device::Parameter parameter = device::resolve(name);
  const auto& entry = parameter.definition();
  return {std::string(parameters_prefix) + parameter.name(), entry.unit, entry.values.empty()};
}

bool is_parameter(std::string_view name) {
  const auto& all = device::all_parameters();
  const std::string_view bare = base::without_axis_0(name);
  return std::any_of(all.begin(), all.end(), [&](const auto& one) { return one.name() == bare; });
}
}  // namespace

NamedSetting resolve_setting(std::string_view name) {
  if (name.starts_with(parameters_prefix)) return parameter_setting(name.substr(parameters_prefix.size()));
  const auto [axis, bare, digits] = base::split_axis(name);
  if (const SceneKey* key = scene_key(bare, !axis.empty()))
    return {std::string(base::without_axis_0(name)), key->unit, key->type == SceneValue::number};
  if (is_parameter(name)) return parameter_setting(name);
  std::vector<std::string> known;
  for (const SceneKey& key : simulation::scene_keys())
    known.push_back((axis.empty() ? "" : std::string(axis) + ".") + key.full());
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (std::find(known.begin(), known.end(), parameter.name()) == known.end())
      known.push_back(parameter.name());
  }
  const std::string meant = base::did_you_mean(name, known);
  throw base::ValueError(
      fmt::format("'{}' is neither a key of a scene nor a parameter{}", name,
                  meant.empty() ? "; 'kmax simulate --keys' and 'kmax list' show them" : meant));
}

simulation::SceneSetting split_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw base::ValueError(fmt::format("'{}': write NAME=VALUE, as in wall.stiffness=3580", text));
  const std::string_view whole = text;
  return {std::string(base::trimmed(whole.substr(0, equals))),
          std::string(base::trimmed(whole.substr(equals + 1)))};
}

std::vector<simulation::SceneSetting> parse_settings(const std::vector<std::string>& texts) {
  std::vector<simulation::SceneSetting> settings;
  for (const std::string& text : texts) {
    simulation::SceneSetting setting = split_setting(text);
    setting.name = resolve_setting(setting.name).name;
    for (const auto& earlier : settings) {
      if (earlier.name == setting.name)
        throw base::ValueError(fmt::format("{}: it is given twice", setting.name));
    }
    settings.push_back(std::move(setting));
  }
  return settings;
}

}  // namespace kmax::simulated_board
