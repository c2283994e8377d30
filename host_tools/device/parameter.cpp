#include "host_tools/device/parameter.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/base/axis_name.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/suggestion.hpp"

namespace kmax::device {

using firmware::axis_count;

namespace {
struct SplitName {
  std::optional<std::size_t> axis;
  std::string_view rest;
};

/// All numbers that no axis has are axis_count.
SplitName split(std::string_view name) {
  const auto [word, rest, digits] = base::split_axis(name);
  if (word.empty()) return {std::nullopt, name};
  std::size_t axis = 0;
  for (const char digit : digits)
    axis = std::min(axis_count, axis * 10 + static_cast<std::size_t>(digit - '0'));
  return {axis, rest};
}

const std::vector<std::string>& dictionary_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < firmware::entry_count; ++i) all.emplace_back(firmware::entry_at(i).name);
    return all;
  }();
  return names;
}

bool is_group(std::string_view name) {
  return std::any_of(dictionary_names().begin(), dictionary_names().end(), [name](const std::string& full) {
    return full.size() > name.size() && full.starts_with(name) && full[name.size()] == '.';
  });
}
}  // namespace

std::string Parameter::name() const {
  if (axis_ == 0) return std::string(definition().name);
  return fmt::format("axis{}.{}", axis_, definition().name);
}

const std::vector<Parameter>& all_parameters() {
  static const std::vector<Parameter> parameters = [] {
    std::vector<Parameter> all;
    for (std::size_t i = 0; i < firmware::entry_count; ++i) all.emplace_back(i, 0);
    for (std::size_t axis = 1; axis < axis_count; ++axis) {
      for (std::size_t i = 0; i < firmware::axis_entries.size(); ++i) all.emplace_back(i, axis);
    }
    return all;
  }();
  return parameters;
}

std::vector<std::string> suggest(std::string_view name) {
  const SplitName parts = split(name);
  auto names = base::closest(parts.rest, dictionary_names());
  if (!parts.axis || *parts.axis >= axis_count) return names;
  for (std::string& one : names) {
    if (firmware::entry_at(firmware::find_entry(one)).scope() == firmware::Scope::axis)
      one = fmt::format("axis{}.{}", *parts.axis, one);
  }
  return names;
}

Parameter resolve(std::string_view name, std::size_t default_axis) {
  const SplitName parts = split(name);
  const std::size_t entry = firmware::find_entry(parts.rest);
  if (entry == firmware::entry_count) {
    if (is_group(parts.rest))
      throw base::ValueError(
          fmt::format("'{}' is a group of parameters; 'kmax list {}.' shows them", name, name));
    const auto names = suggest(name);
    throw base::ValueError(fmt::format("there is no parameter '{}'{}", name,
                                       names.empty()
                                           ? "; 'kmax list' shows all of them"
                                           : fmt::format("; did you mean {}?", fmt::join(names, " or "))));
  }
  const auto& definition = firmware::entry_at(entry);
  if (parts.axis && *parts.axis >= axis_count)
    throw base::ValueError(
        fmt::format("'{}': there is no such axis; axes are 0 .. {}", name, axis_count - 1));
  if (parts.axis && definition.scope() == firmware::Scope::device)
    throw base::ValueError(fmt::format("'{}': {} belongs to the whole device, not to an axis; write {}", name,
                                       parts.rest, parts.rest));
  return {entry, parts.axis.value_or(default_axis)};
}

std::optional<Parameter> owner_of_holding_register(std::uint16_t address) {
  for (const Parameter& parameter : all_parameters()) {
    if (parameter.table() == Table::holding && parameter.address() <= address &&
        address < parameter.address() + parameter.words())
      return parameter;
  }
  return std::nullopt;
}

}  // namespace kmax::device
