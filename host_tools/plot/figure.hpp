#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/plot/gnuplot_picture.hpp"

namespace kmax::plot {

/// A curve. x and y have the same length; values that are not finite leave a gap.
struct Series {
  std::string label;  ///< empty: not in the legend
  std::vector<double> x, y;
  bool steps = false;   ///< held values: drawn as stairs
  bool points = false;  ///< each value marked, joined by a line
};

/// A horizontal or vertical mark, with a text beside it.
struct Mark {
  double at;
  bool vertical;
  std::string label;
};

/// One set of axes. Labels carry the units.
struct Panel {
  std::string y_label;
  std::vector<Series> series;
  std::vector<Mark> marks;
  std::optional<std::pair<double, double>> y_limits{};  ///< what to show; without: all of it
  bool log_y = false;                                   ///< values that are not above 0 leave a gap
};

/// Panels stacked above one x axis.
struct Figure {
  std::string title;
  std::string x_label;
  std::vector<Panel> panels;
  bool log_x = false;          ///< values that are not above 0 leave a gap
  bool legend_beside = false;  ///< on the right of the panels instead of over the curves
};

/// Draws with gnuplot into an SVG or a PNG, by the file's ending. Curves keep Okabe and Ito's colours, which
/// colour-blind readers can tell apart, and differ in dash pattern too. The folder must exist. About 0.1 s.
/// Throws FigureError, PictureNameError; a picture appears whole or not at all.
void write_figure(const Figure& figure, const std::filesystem::path& path);

}  // namespace kmax::plot
