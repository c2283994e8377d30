#include "host_tools/check/map_contour.hpp"

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace kmax::check {

using plot::Outline;

namespace {
struct Point {
  double x, y;
};

/// The corners of a cell in turn, as steps from its lowest one.
constexpr std::array<std::pair<std::size_t, std::size_t>, 4> corners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

/// A cell of the grid: the side i lies between corner i and the next.
class Cell {
 public:
  Cell(const Field& field, std::size_t column, std::size_t row) : column_(column), row_(row) {
    for (std::size_t i = 0; i < 4; ++i) {
      value_[i] = field.at(column + corners[i].first, row + corners[i].second);
      known_ = known_ && !std::isnan(value_[i]);
    }
  }

  bool known() const { return known_; }
  bool positive(std::size_t corner) const { return value_[corner % 4] >= 0; }
  bool all_positive() const { return positive(0) && positive(1) && positive(2) && positive(3); }
  bool crossed(std::size_t side) const { return positive(side) != positive(side + 1); }
  bool middle_positive() const { return value_[0] + value_[1] + value_[2] + value_[3] >= 0; }

  Point corner(std::size_t i) const {
    return {static_cast<double>(column_ + corners[i % 4].first),
            static_cast<double>(row_ + corners[i % 4].second)};
  }
  Point crossing(std::size_t side) const {
    const double here = value_[side], there = value_[(side + 1) % 4];
    const double share = here / (here - there);
    const Point a = corner(side), b = corner(side + 1);
    return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
  }
  /// One number for a side, the same from both cells that it parts.
  std::size_t side_number(std::size_t side, std::size_t columns) const {
    const std::size_t column = column_ + (side == 1 ? 1 : 0), row = row_ + (side == 2 ? 1 : 0);
    return 2 * (row * columns + column) + side % 2;
  }

 private:
  std::size_t column_, row_;
  std::array<double, 4> value_{};
  bool known_ = true;
};

/// Short pieces of line, joined where they meet.
class Strokes {
 public:
  void add(std::size_t a, Point at_a, std::size_t b, Point at_b) {
    ends_[a].push_back(b);
    ends_[b].push_back(a);
    points_[a] = at_a;
    points_[b] = at_b;
  }

  std::vector<Outline> joined() {
    std::vector<Outline> all;
    // Open ones from an end; what is left then are rings.
    for (const bool rings : {false, true}) {
      for (const auto& [start, unused] : points_) {
        const std::size_t pieces = ends_[start].size();
        if (pieces == 1 || (rings && pieces > 0)) all.push_back(from(start));
      }
    }
    return all;
  }

 private:
  Outline from(std::size_t place) {
    Outline line;
    for (;;) {
      line.x.push_back(points_[place].x);
      line.y.push_back(points_[place].y);
      if (ends_[place].empty()) return line;
      const std::size_t next = ends_[place].back();
      ends_[place].pop_back();
      std::erase(ends_[next], place);
      place = next;
    }
  }

  std::map<std::size_t, std::vector<std::size_t>> ends_;
  std::map<std::size_t, Point> points_;
};

void add(Outline& outline, Point point) {
  outline.x.push_back(point.x);
  outline.y.push_back(point.y);
}

/// The positive part of a cell that has both signs.
Outline positive_part(const Cell& cell) {
  Outline outline;
  for (std::size_t i = 0; i < 4; ++i) {
    if (cell.positive(i)) add(outline, cell.corner(i));
    if (cell.crossed(i)) add(outline, cell.crossing(i));
  }
  return outline;
}
}  // namespace

std::vector<Outline> zero_lines(const Field& field) {
  Strokes strokes;
  for (std::size_t row = 0; row + 1 < field.rows; ++row) {
    for (std::size_t column = 0; column + 1 < field.columns; ++column) {
      const Cell cell(field, column, row);
      if (!cell.known()) continue;
      std::vector<std::size_t> sides;
      for (std::size_t side = 0; side < 4; ++side) {
        if (cell.crossed(side)) sides.push_back(side);
      }
      // A saddle has four: its middle says which belong together.
      if (sides.size() == 4 && cell.positive(0) == cell.middle_positive())
        sides = {0, 1, 2, 3};
      else if (sides.size() == 4)
        sides = {3, 0, 1, 2};
      for (std::size_t i = 0; i + 1 < sides.size(); i += 2)
        strokes.add(cell.side_number(sides[i], field.columns), cell.crossing(sides[i]),
                    cell.side_number(sides[i + 1], field.columns), cell.crossing(sides[i + 1]));
    }
  }
  return strokes.joined();
}

std::vector<Outline> positive_area(const Field& field) {
  std::vector<Outline> all;
  for (std::size_t row = 0; row + 1 < field.rows; ++row) {
    std::optional<std::size_t> begun;  // a run of whole cells becomes one polygon
    for (std::size_t column = 0; column < field.columns; ++column) {
      const bool last = column + 1 == field.columns;
      const std::optional<Cell> cell = last ? std::nullopt : std::optional(Cell(field, column, row));
      const bool whole = cell && cell->known() && cell->all_positive();
      if (whole) {
        if (!begun) begun = column;
        continue;
      }
      if (begun) {
        const auto left = static_cast<double>(*begun), right = static_cast<double>(column);
        const auto low = static_cast<double>(row);
        all.push_back({{left, right, right, left}, {low, low, low + 1, low + 1}});
        begun.reset();
      }
      if (!cell || !cell->known()) continue;
      Outline part = positive_part(*cell);
      if (!part.x.empty()) all.push_back(std::move(part));
    }
  }
  return all;
}

}  // namespace kmax::check
