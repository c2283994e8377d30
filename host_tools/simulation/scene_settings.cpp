#include "host_tools/simulation/scene_settings.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/base/axis_name.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/simulation/scene_keys.hpp"

namespace kmax::simulation {

namespace {
constexpr std::string_view parameters_name = "parameters";

// "axis1" of "axis1.device.mass", which then is the rest.
std::optional<std::string> take_axis(std::string_view& name) {
  const auto [axis, rest, digits] = base::split_axis(name);
  name = rest;
  if (axis.empty() || axis == "axis0") return std::nullopt;
  return std::string(axis);
}

// However its name is spread over tables in the file.
void erase_parameter(toml::table& table, const std::string& prefix, std::string_view name) {
  std::vector<std::string> erased;
  for (auto&& [key, node] : table) {
    const std::string full = prefix + std::string(key.str());
    if (toml::table* inner = node.as_table()) {
      erase_parameter(*inner, full + ".", name);
    } else if (base::without_axis_0(full) == base::without_axis_0(name)) {
      erased.emplace_back(key.str());
    }
  }
  for (const std::string& key : erased) table.erase(key);
}

void insert_text(toml::table& table, std::string_view name, SceneValue type, std::string_view text) {
  std::int64_t whole = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), whole);
  if (type == SceneValue::truth && (text == "true" || text == "false")) {
    table.insert_or_assign(name, text == "true");
  } else if (type == SceneValue::whole && error == std::errc{} && end == text.data() + text.size()) {
    table.insert_or_assign(name, whole);
  } else if (type == SceneValue::words) {
    toml::array words;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t comma = std::min(text.find(',', at), text.size());
      words.push_back(std::string(base::trimmed(text.substr(at, comma - at))));
      at = comma + 1;
    }
    table.insert_or_assign(name, std::move(words));
  } else {
    table.insert_or_assign(name, std::string(text));
  }
}

void put_parameter(toml::table& root, std::string_view name, std::string_view value) {
  if (!root.contains(parameters_name)) root.insert(parameters_name, toml::table{});
  toml::table* parameters = root[parameters_name].as_table();
  if (parameters == nullptr) return;  // which the reader refuses
  erase_parameter(*parameters, "", name);
  parameters->insert_or_assign(name, std::string(value));
}

void put(toml::table& root, const SceneSetting& setting, std::string_view source) {
  std::string_view name = setting.name;
  if (name.starts_with(parameters_name) && name.substr(parameters_name.size()).starts_with('.'))
    return put_parameter(root, name.substr(parameters_name.size() + 1), setting.value);
  toml::table* holder = &root;
  const auto refuse = [&](const std::string& what) {
    throw SceneError(fmt::format("--set {}={}: {} {}", setting.name, setting.value, source, what));
  };
  const std::optional<std::string> axis = take_axis(name);
  if (axis) {
    holder = root[*axis].as_table();
    if (holder == nullptr) refuse(fmt::format("has no [{}.device], and so no such axis", *axis));
  }
  const std::size_t dot = name.find('.');
  const std::string_view table_name = dot == std::string_view::npos ? "" : name.substr(0, dot);
  const std::string_view key_name = dot == std::string_view::npos ? name : name.substr(dot + 1);
  if (dot != std::string_view::npos) {
    const SceneTable* table = scene_table_named(table_name);
    if (!holder->contains(table_name)) {
      if (table != nullptr && table->part)
        refuse(
            fmt::format("has no [{0}{1}{2}], so there is nothing to set; write a scene that has one: copy "
                        "the file and add the table",
                        axis.value_or(""), axis ? "." : "", table_name));
      holder->insert(table_name, toml::table{});
    }
    holder = (*holder)[table_name].as_table();
    if (holder == nullptr) return;  // which the reader refuses
  }
  const SceneKey* key = find_scene_key(table_name, key_name);
  insert_text(*holder, key_name, key == nullptr ? SceneValue::text : key->type, setting.value);
}
}  // namespace

void put_settings(toml::table& root, std::span<const SceneSetting> settings, std::string_view source) {
  for (const SceneSetting& setting : settings) put(root, setting, source);
}

}  // namespace kmax::simulation
