#pragma once

#include <cstddef>
#include <string_view>

namespace kmax::base {

/// In digits alone, and none of them too many: other ways to write a number mean another one to some readers.
constexpr bool is_plain_number(std::string_view text) {
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  return digits && (text.size() == 1 || text.front() != '0');
}

/// A name's axis and what is left of it: "axis1" and "device.mass" of "axis1.device.mass".
struct AxisName {
  std::string_view axis;  ///< "axis" and a number without leading zeros; empty if the name begins otherwise
  std::string_view rest;
  std::string_view digits;  ///< of the axis
};
constexpr AxisName split_axis(std::string_view name) {
  constexpr std::string_view word = "axis";
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos || !name.starts_with(word)) return {{}, name, {}};
  const std::string_view digits = name.substr(word.size(), dot - word.size());
  if (!is_plain_number(digits)) return {{}, name, {}};
  return {name.substr(0, dot), name.substr(dot + 1), digits};
}

/// Axis 0 may be named or not: the name without it.
constexpr std::string_view without_axis_0(std::string_view name) {
  const AxisName split = split_axis(name);
  return split.axis == "axis0" ? split.rest : name;
}

}  // namespace kmax::base
