#include "host_tools/plot/map_figure.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::plot::map_figure_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

MapFigure map() {
  MapFigure figure;
  figure.title = "a_title";
  figure.x_label = "x_1 (m)";
  figure.y_label = "y (N)";
  figure.x_limits = {1, 100};
  figure.y_limits = {0, 2};
  figure.log_x = true;
  figure.regions = {{"inside", "#cfe5f5", {{{1, 10, 10, 1}, {0, 0, 1, 1}}, {{10, 20, 10}, {0, 0, 1}}}}};
  figure.lines = {{"border", {{{1, 10, 20}, {1, 1, 0}}, {{50, 60}, {0.5, 2}}}, 2}, {"nowhere", {}, 3}};
  figure.point = MapPoint{"here", 5, 0.5};
  return figure;
}

TEST(MapFigure, SvgAndPngByTheNamesEnding) {
  const TemporaryFolder folder;
  write_map_figure(map(), folder / "a.svg");
  const std::string svg = folder.read("a.svg");
  for (const char* text : {"</svg>", "a_title", "x_1 (m)", "y (N)", ">inside<", ">border<", ">here<",
                           "rgb(  0, 158, 115)", ">1<", ">20<", ">100<"})
    EXPECT_CONTAINS(svg, text);
  EXPECT_EQ(svg.find("nowhere"), std::string::npos) << "what is not drawn is not in the legend";
  write_map_figure(map(), folder / "a.png");
  EXPECT_EQ(folder.read("a.png").substr(1, 3), "PNG");
  EXPECT_EQ(folder.entries(), 2u) << "something was left behind";
}

TEST(MapFigure, AnEmptyMapIsOne) {
  const TemporaryFolder folder;
  MapFigure figure = map();
  figure.regions.clear();
  figure.lines.clear();
  figure.point.reset();
  figure.x_limits = {1, 1e9};
  write_map_figure(figure, folder / "a.svg");
  EXPECT_CONTAINS(folder.read("a.svg"), "x_1 (m)");
}

TEST(MapFigure, SidesThatAreNoRangeAreRefused) {
  const TemporaryFolder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& side : {std::pair(0.0, 1.0), std::pair(2.0, 1.0), std::pair(1.0, nan)}) {
    MapFigure figure = map();
    figure.x_limits = side;
    EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_map_figure(figure, folder / "a.svg"); }),
                    "no range");
  }
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace kmax::plot::map_figure_test
