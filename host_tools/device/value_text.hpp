#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/device/parameter.hpp"

namespace kmax::device {

/// A value that is to be written.
struct Assignment {
  Parameter parameter;
  std::uint32_t raw;

  friend bool operator==(const Assignment&, const Assignment&) = default;
};

/// A value as a user writes it: a number in the parameter's own unit, or with a unit that converts to it
/// ("3.58N/mm", "1 mm"), or a choice by name or number. The result is in range.
///
/// Refused with what is allowed: anything that is not wholly a number and a unit, NaN, infinities, numbers
/// that do not fit the type, fractions for whole numbers, values out of range, unknown choices. Range is
/// judged in the value's own type, as the device does: a text that rounds to an allowed float32 is allowed.
/// Errors: ValueError.
std::uint32_t parse_value(const Parameter& parameter, std::string_view text);

/// Where the handle of an axis is, m.
using HandlePosition = std::function<double(std::size_t axis)>;

/// "NAME=VALUE" each; a name without a prefix is on `default_axis`. A parameter that is read only, is named
/// twice, or is a command rather than a value is refused. wall.position also takes "here", "here+5mm" and
/// "here-5mm", if `here` can be asked, which it is only then. Errors: ValueError, and what `here` throws.
std::vector<Assignment> parse_assignments(const std::vector<std::string>& texts, std::size_t default_axis = 0,
                                          const HandlePosition& here = {});

/// A value without its unit, such that parse_value() gives it back: choices by name.
std::string value_text(const Parameter& parameter, std::uint32_t raw);

/// The same with its unit: "3580 N/m", "magnetic".
std::string value_with_unit(const Parameter& parameter, std::uint32_t raw);

/// "0 .. 1e6 N/m", or "none, plain, magnetic, adaptive".
std::string allowed_text(const Parameter& parameter);

/// 0 and -0 are one value, everything else is its pattern.
bool same_value(const Parameter& parameter, std::uint32_t a, std::uint32_t b);

}  // namespace kmax::device
