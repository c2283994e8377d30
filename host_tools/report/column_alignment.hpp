#pragma once

#include <string_view>
#include <vector>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// Is it a number as people write one: sign, digits with a point or an exponent, and perhaps after a
/// space a unit or its spread in brackets ("-3.58", "1e-3", "17.4 %", "0.165 mm", "3.58 (0.41)")? A range, a
/// list or a date is not.
bool reads_as_number(std::string_view text);

/// For each column: do numbers stand in it, so that it is read best when its right edge is straight? A column
/// of numbers may have empty cells and "-" or "not measured" marks ("NA"), but not these alone.
std::vector<bool> number_columns(const Table& table);

}  // namespace kmax::report
