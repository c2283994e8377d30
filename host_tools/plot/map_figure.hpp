#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/plot/gnuplot_picture.hpp"

namespace kmax::plot {

/// A closed polygon, or one stroke of a line.
struct Outline {
  std::vector<double> x, y;
};

/// An area, given as polygons that together cover it.
struct MapRegion {
  std::string label;   ///< empty: not in the legend
  std::string colour;  ///< "#RRGGBB"
  std::vector<Outline> polygons;
};

/// A line in as many strokes as it takes. `style` (any number) fixes colour and dash pattern, so that the
/// same thing looks the same in every map.
struct MapLine {
  std::string label;
  std::vector<Outline> strokes;
  std::size_t style = 0;
};

struct MapPoint {
  std::string label;
  double x, y;
};

/// A plane of two quantities: regions below, lines over them, one point on top. Labels carry the units.
struct MapFigure {
  std::string title, x_label, y_label;
  std::pair<double, double> x_limits, y_limits;  ///< first < second; of a logarithmic axis above 0
  bool log_x = false, log_y = false;
  std::vector<MapRegion> regions;
  std::vector<MapLine> lines;
  std::optional<MapPoint> point;
};

/// Draws with gnuplot into an SVG or a PNG, by the file's ending. Lines take Okabe and Ito's colours first
/// and differ in dash pattern too; the legend stands beside the map. The folder must exist. About 0.1 s.
/// Throws FigureError, PictureNameError; a picture appears whole or not at all.
void write_map_figure(const MapFigure& figure, const std::filesystem::path& path);

}  // namespace kmax::plot
