#pragma once
// Reads the tables of a scene file: finds parts, refuses what is unknown, of the wrong type or out of range,
// with the place in the file. For the readers of scenes only: it needs toml++.

#include <fmt/format.h>
#include <toml++/toml.h>

#include <array>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

class SceneTables {
 public:
  // `source` stands for the file name in messages.
  explicit SceneTables(std::string_view source) : source_(source) {}

  const std::string& source() const { return source_; }

  // Throws SceneError that begins with file:line:column.
  [[noreturn]] void fail(const toml::source_region& where, const std::string& what) const;

  std::string place(const toml::source_region& where) const;

  // The value as a person would write it.
  static std::string text_of(const toml::node& node);

  // Refuses keys that are not listed, with what may have been meant. `prefix`: what stands before a key in
  // messages, "axis1.device.".
  void require_known(const toml::table& table, std::string_view prefix,
                     std::span<const std::string_view> allowed) const;
  void require_known(const toml::table& table, std::string_view prefix,
                     std::initializer_list<std::string_view> allowed) const {
    require_known(table, prefix, std::span<const std::string_view>(allowed.begin(), allowed.size()));
  }

  // The table of this name, or nullptr if it is not there.
  const toml::table* part(const toml::table& table, std::string_view prefix, std::string_view name) const;

  // "a", "b" or "c".
  static std::string one_of(std::span<const std::string_view> words);
  // The place in `words` of the text that the key has, or nothing if the key is not there.
  std::optional<std::size_t> read_choice(const toml::table& table, std::string_view prefix,
                                         std::string_view name,
                                         std::span<const std::string_view> words) const;

  // Leaves `value` as it is if the key is not there.
  void read_text(const toml::table& table, std::string_view name, std::string& value) const;
  void read_truth(const toml::table& table, std::string_view prefix, std::string_view name,
                  bool& value) const;

  // A number, or a text with one in `unit` or in a unit that converts to it; nothing if it is neither.
  // Refuses a text that is no such number. `name` and `allowed`: for messages.
  std::optional<double> number_of(const toml::node& node, std::string_view name, std::string_view unit,
                                  std::string_view allowed) const;

  // Numbers that are there replace those of the model.
  template <typename Model, std::size_t count>
  void read_fields(const toml::table& table, std::string_view prefix,
                   const std::array<ModelField<Model>, count>& fields, Model& model) const {
    for (const ModelField<Model>& field : fields) {
      const toml::node* node = table.get(field.name);
      if (node == nullptr) continue;
      const std::optional<double> value =
          number_of(*node, fmt::format("{}{}", prefix, field.name), field.unit, allowed_range(field));
      if (!value || !is_allowed(field, *value)) {
        fail(node->source(), fmt::format("{}{} = {}: allowed is {}", prefix, field.name, text_of(*node),
                                         allowed_range(field)));
      }
      model.*field.member = *value;
    }
  }

  // A table whose keys are the fields of one model and `others`, which are read elsewhere.
  template <typename Model, std::size_t count>
  void read_model(const toml::table& table, const std::string& prefix,
                  const std::array<ModelField<Model>, count>& fields, Model& model,
                  std::initializer_list<std::string_view> others = {}) const {
    std::vector<std::string_view> allowed(others);
    for (const ModelField<Model>& field : fields) allowed.push_back(field.name);
    require_known(table, prefix, std::span<const std::string_view>(allowed));
    read_fields(table, prefix, fields, model);
  }

 private:
  std::string source_;
};

}  // namespace kmax::simulation
