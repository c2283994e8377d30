#pragma once
// One table per model: every number of a model is listed once, with its range, unit and meaning. The
// validation of a struct, the reading of a scene file and the list of its keys (scene_keys.hpp) go through
// it.

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace kmax::simulation {

// `minimum` and `maximum` are both allowed. NaN and infinities never are.
template <typename Model>
struct ModelField {
  std::string_view name;
  double Model::*member;
  double minimum;
  double maximum;
  std::string_view unit;
  std::string_view meaning = "";
  std::string_view note = "";  // on the range: "whole", "0: no limit"
};

template <typename Model>
bool is_allowed(const ModelField<Model>& field, double value) {
  return std::isfinite(value) && value >= field.minimum && value <= field.maximum;
}

template <typename Model>
std::string allowed_range(const ModelField<Model>& field) {
  return fmt::format("a number from {} to {}{}{}{}", field.minimum, field.maximum,
                     field.unit.empty() ? "" : " ", field.unit,
                     field.note.empty() ? "" : fmt::format(" ({})", field.note));
}

// Throws std::invalid_argument that names the first field outside its range, its value and the range.
template <typename Model>
void require_allowed(const Model& model, std::span<const ModelField<Model>> fields,
                     std::string_view model_name) {
  for (const ModelField<Model>& field : fields) {
    const double value = model.*field.member;
    if (!is_allowed(field, value)) {
      throw std::invalid_argument(
          fmt::format("{}.{} = {}: allowed is {}", model_name, field.name, value, allowed_range(field)));
    }
  }
}

}  // namespace kmax::simulation
