#include "host_tools/report/page.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kmax::report {

std::string_view to_string(Origin origin) {
  switch (origin) {
    case Origin::calibrated:
      return "calibrated";
    case Origin::predicted:
      return "predicted";
    case Origin::measured:
      return "measured";
    case Origin::paper:
      return "paper";
  }
  return "";
}

void require_rectangular(const Table& table) {
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (table.rows[i].size() == table.columns.size()) continue;
    throw std::invalid_argument(fmt::format("table '{}', row {}: has {} cells for {} columns", table.caption,
                                            i + 1, table.rows[i].size(), table.columns.size()));
  }
}

}  // namespace kmax::report
