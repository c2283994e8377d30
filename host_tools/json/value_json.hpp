#pragma once

#include <cstdint>
#include <optional>

#include "host_tools/device/parameter.hpp"
#include "host_tools/json/json.hpp"

namespace kmax::json {

/// Choices as their names; numbers as the shortest text that gives the same value, whole ones without a
/// fraction.
Json value_json(const device::Parameter& parameter, std::uint32_t raw);

/// A number of the dictionary itself (a bound).
Json number_json(double number);

/// null for what is not known.
template <typename Value>
Json optional_json(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

/// {"value": ..., "unit": ...}
Json value_and_unit_json(const device::Parameter& parameter, std::uint32_t raw);

/// One object of `kmax describe --format json`.
Json description_json(const device::Parameter& parameter);

}  // namespace kmax::json
