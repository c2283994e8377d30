#pragma once

#include <cstddef>
#include <vector>

#include "host_tools/plot/map_figure.hpp"

namespace kmax::check {

/// Numbers at the points of a grid, row by row; NaN where there is none.
struct Field {
  std::size_t columns, rows;
  std::vector<double> values;

  double at(std::size_t column, std::size_t row) const { return values[row * columns + column]; }
};

/// Where a field changes its sign (0 counts as positive), as strokes as long as they come, in grid
/// coordinates: x from 0 to columns - 1, y from 0 to rows - 1. Linear between neighbours (marching squares);
/// a cell with a NaN at a corner has no line.
std::vector<plot::Outline> zero_lines(const Field& field);

/// Polygons, in the same coordinates, that cover where the field is positive and nothing else.
std::vector<plot::Outline> positive_area(const Field& field);

}  // namespace kmax::check
