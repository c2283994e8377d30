#include "host_tools/simulation/scene_table.hpp"

#include <sstream>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

std::string SceneTables::text_of(const toml::node& node) {
  if (node.is_table()) return "{table}";
  if (node.is_array()) return "[array]";
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

void SceneTables::fail(const toml::source_region& where, const std::string& what) const {
  throw SceneError(fmt::format("{}: {}", place(where), what));
}

std::string SceneTables::place(const toml::source_region& where) const {
  return fmt::format("{}:{}:{}", source_, where.begin.line, where.begin.column);
}

void SceneTables::refuse_key(const toml::key& key, const toml::node& node, std::string_view prefix,
                             const std::string& allowed) const {
  fail(key.source(),
       fmt::format("{}{} = {}: unknown key; allowed here: {}", prefix, key.str(), text_of(node), allowed));
}

void SceneTables::require_known(const toml::table& table, std::string_view prefix,
                                std::initializer_list<std::string_view> allowed) const {
  for (const auto& [key, node] : table) {
    if (std::find(allowed.begin(), allowed.end(), key.str()) != allowed.end()) continue;
    std::string list;
    for (const std::string_view name : allowed) list += (list.empty() ? "" : ", ") + std::string(name);
    refuse_key(key, node, prefix, list);
  }
}

const toml::table* SceneTables::part(const toml::table& table, std::string_view prefix,
                                     std::string_view name) const {
  const toml::node* node = table.get(name);
  if (node == nullptr) return nullptr;
  if (!node->is_table()) {
    fail(node->source(),
         fmt::format("{}{} = {}: allowed is a table, [{}{}]", prefix, name, text_of(*node), prefix, name));
  }
  return node->as_table();
}

void SceneTables::read_text(const toml::table& table, std::string_view name, std::string& value) const {
  const toml::node* node = table.get(name);
  if (node == nullptr) return;
  if (!node->is_string())
    fail(node->source(), fmt::format("{} = {}: allowed is a text in quotes", name, text_of(*node)));
  value = node->as_string()->get();
}

void SceneTables::read_truth(const toml::table& table, std::string_view prefix, std::string_view name,
                             bool& value) const {
  const toml::node* node = table.get(name);
  if (node == nullptr) return;
  if (!node->is_boolean())
    fail(node->source(), fmt::format("{}{} = {}: allowed is true or false", prefix, name, text_of(*node)));
  value = node->as_boolean()->get();
}

}  // namespace kmax::simulation
