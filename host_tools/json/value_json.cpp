#include "host_tools/json/value_json.hpp"

#include <bit>
#include <cmath>
#include <string>

#include "host_tools/base/numbers.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::json {

using firmware::Entry;
using firmware::Type;

namespace {
std::string_view type_name(Type type) {
  switch (type) {
    case Type::unsigned8:
      return "unsigned8";
    case Type::integer8:
      return "integer8";
    case Type::unsigned16:
      return "unsigned16";
    case Type::unsigned32:
      return "unsigned32";
    case Type::integer32:
      return "integer32";
    case Type::float32:
      return "float32";
    case Type::integer16:
      return "integer16";
  }
  return "unknown";
}

std::string_view access_name(firmware::Access access) {
  switch (access) {
    case firmware::Access::read_only:
      return "ro";
    case firmware::Access::communication:
      return "rw over CANopen";
    case firmware::Access::read_write:
      break;
  }
  return "rw";
}

/// How it may change while its axis is armed.
std::string_view change_name(firmware::Change change) {
  switch (change) {
    case firmware::Change::any_time:
      return "any";
    case firmware::Change::disarmed_only:
      return "none";
    case firmware::Change::only_lower:
      return "lower";
    case firmware::Change::only_higher:
      return "higher";
    case firmware::Change::only_nearer_zero:
      return "nearer to 0";
  }
  return "unknown";
}

/// Of the parameter's own axis; null: it has none.
Json ceiling_json(const device::Parameter& parameter) {
  const std::string_view name = parameter.definition().ceiling;
  if (name.empty()) return nullptr;
  return device::Parameter(firmware::find_entry(name), parameter.axis()).name();
}
}  // namespace

Json number_json(double number) {
  constexpr double exact = 9007199254740992.0;  // every whole number up to 2^53 is a double
  if (number == std::floor(number) && std::fabs(number) < exact) return static_cast<std::int64_t>(number);
  return number;
}

Json value_json(const device::Parameter& parameter, std::uint32_t raw) {
  const Entry& entry = parameter.definition();
  if (!entry.values.empty()) return device::value_text(parameter, raw);
  if (entry.type == Type::float32) return number_json(base::shortest_double(std::bit_cast<float>(raw)));
  return number_json(firmware::number_from_raw(entry.type, raw));
}

Json value_and_unit_json(const device::Parameter& parameter, std::uint32_t raw) {
  return {{"value", value_json(parameter, raw)}, {"unit", std::string(parameter.definition().unit)}};
}

Json description_json(const device::Parameter& parameter) {
  const Entry& entry = parameter.definition();
  Json names;  // null unless it is a choice
  for (const auto& value : entry.values) names.push_back(std::string(value.name));
  return {
      {"name", parameter.name()},
      {"index", parameter.index()},
      {"subindex", entry.object_subindex()},
      {"type", std::string(type_name(entry.type))},
      {"unit", std::string(entry.unit)},
      {"access", std::string(access_name(entry.access))},
      {"min", number_json(entry.minimum)},
      {"max", number_json(entry.maximum)},
      {"default", value_json(parameter, parameter.default_raw())},
      {"values", names},
      {"persistent", entry.persistent},
      {"change_while_armed",
       entry.access == firmware::Access::read_only ? Json(nullptr) : Json(change_name(entry.change))},
      {"only_commander", entry.group.of_commander},
      {"ceiling", ceiling_json(parameter)},
      {"modbus",
       {{"table", parameter.table() == device::Table::holding ? "holding" : "input"},
        {"address", parameter.address()},
        {"words", parameter.words()}}},
      {"help", std::string(entry.help)},
  };
}

}  // namespace kmax::json
