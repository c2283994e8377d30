#include "host_tools/simulation/scene_table.hpp"

#include <algorithm>
#include <sstream>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

std::string SceneTables::text_of(const toml::node& node) {
  if (node.is_table()) return "{table}";
  if (node.is_array()) return "[array]";
  if (const auto* number = node.as_floating_point()) {
    // The shortest that reads back equal, with a sign that it is no whole number.
    const std::string shortest = fmt::format("{}", number->get());
    return shortest + (shortest.find_first_not_of("-0123456789") == std::string::npos ? ".0" : "");
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

void SceneTables::fail(const toml::source_region& where, const std::string& what) const {
  throw SceneError(fmt::format("{}: {}", place(where), what));
}

std::string SceneTables::place(const toml::source_region& where) const {
  if (where.begin.line == 0) return "--set";  // not from the file
  return fmt::format("{}:{}:{}", source_, where.begin.line, where.begin.column);
}

void SceneTables::require_known(const toml::table& table, std::string_view prefix,
                                std::span<const std::string_view> allowed) const {
  for (const auto& [key, node] : table) {
    if (std::find(allowed.begin(), allowed.end(), key.str()) != allowed.end()) continue;
    const std::vector<std::string> names(allowed.begin(), allowed.end());
    fail(key.source(),
         fmt::format("{}{} = {}: unknown key; allowed here: {}{}", prefix, key.str(), text_of(node),
                     fmt::join(names, ", "), base::did_you_mean(key.str(), names)));
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

std::string SceneTables::one_of(std::span<const std::string_view> words) {
  std::string list;
  for (std::size_t n = 0; n < words.size(); ++n)
    list += fmt::format("{}\"{}\"", n == 0 ? "" : n + 1 == words.size() ? " or " : ", ", words[n]);
  return list;
}

std::optional<std::size_t> SceneTables::read_choice(const toml::table& table, std::string_view prefix,
                                                    std::string_view name,
                                                    std::span<const std::string_view> words) const {
  const toml::node* node = table.get(name);
  if (node == nullptr) return std::nullopt;
  const auto word = std::find(words.begin(), words.end(),
                              node->is_string() ? std::string_view(node->as_string()->get()) : "");
  if (word == words.end()) {
    const std::string given = node->is_string() ? node->as_string()->get() : "";
    const std::vector<std::string> names(words.begin(), words.end());
    fail(node->source(), fmt::format("{}{} = {}: allowed is {}{}", prefix, name, text_of(*node),
                                     one_of(words), base::did_you_mean(given, names)));
  }
  return static_cast<std::size_t>(word - words.begin());
}

std::optional<double> SceneTables::number_of(const toml::node& node, std::string_view name,
                                             std::string_view unit, std::string_view allowed) const {
  // value_exact would refuse `mass = 1`, value<double> would accept `true`: a number is an integer or a
  // float.
  if (node.is_number()) return node.value<double>();
  if (!node.is_string()) return std::nullopt;
  try {
    return base::written_number(node.as_string()->get(), unit, "a number", "a smaller one").value;
  } catch (const base::ValueError& error) {
    fail(node.source(), fmt::format("{} = {}; allowed is {}", name, error.what(), allowed));
  }
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
