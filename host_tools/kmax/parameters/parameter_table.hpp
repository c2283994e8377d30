#pragma once

#include <optional>
#include <ostream>
#include <span>

#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::cli {

struct ParameterRow {
  device::Parameter parameter;
  std::uint32_t raw;
};

/// An aligned table: name, value, unit, range, default, help, a line for each row. A value that is not the
/// default is marked with '*'. On a terminal lines are cut to its width, 60 at least; below 120 columns
/// defaults are left out, and help where it has no room. Elsewhere (`terminal` is empty) they are whole, so
/// that they can be searched. `whole_texts`: what would be cut follows on lines of its own.
void print_parameter_table(std::ostream& out, std::span<const ParameterRow> rows,
                           std::optional<base::TerminalSize> terminal, bool whole_texts);

}  // namespace kmax::cli
