#pragma once

#include <ostream>
#include <span>

#include "host_tools/device/parameter.hpp"

namespace kmax::cli {

struct ParameterRow {
  device::Parameter parameter;
  std::uint32_t raw;
};

/// An aligned table of at most 120 columns: name, value, unit, range, default, help. A value that is not
/// the default is marked with '*'. `whole_texts`: long ranges and help are wrapped instead of cut.
void print_parameter_table(std::ostream& out, std::span<const ParameterRow> rows, bool whole_texts);

}  // namespace kmax::cli
