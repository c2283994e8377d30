#include "host_tools/plot/figure.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::plot::figure_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

Figure figure_of(Series series) {
  Figure figure;
  figure.title = "title";
  figure.x_label = "x (m)";
  figure.panels = {{"y (N)", {std::move(series)}, {{0.5, true, "a mark"}, {1.5, false, "level"}}}};
  return figure;
}
const Series line{"line", {0, 1, 2}, {1, 3, 2}};

TEST(Figure, SvgAndPngByTheNamesEnding) {
  const TemporaryFolder folder;
  write_figure(figure_of(line), folder / "a.svg");
  const std::string svg = folder.read("a.svg");
  for (const char* text :
       {"<svg", "</svg>", "title", "x (m)", "y (N)", "a mark", "level", ">line<", "rgb(  0, 114, 178)"})
    EXPECT_CONTAINS(svg, text);
  write_figure(figure_of(line), folder / "a.png");
  EXPECT_EQ(folder.read("a.png").substr(1, 3), "PNG");
  EXPECT_EQ(folder.entries(), 2u) << "something was left behind";
}

TEST(Figure, PanelsStandAboveEachOther) {
  const TemporaryFolder folder;
  Figure figure = figure_of(line);
  figure.panels.push_back({"second", {line, {"other", {0, 2}, {5, 6}, true}}, {}, std::pair(0.0, 10.0)});
  write_figure(figure, folder / "a.svg");
  EXPECT_CONTAINS(folder.read("a.svg"), "second");
  EXPECT_CONTAINS(folder.read("a.svg"), "other");
}

TEST(Figure, PanelsShowTheSamePartOfTheirXAxis) {
  const TemporaryFolder folder;
  Figure figure = figure_of({"long", {1, 1000}, {1, 2}});
  figure.panels[0].marks.clear();
  figure.panels.push_back({"short", {{"", {1, 10}, {1, 2}}}, {}});
  write_figure(figure, folder / "a.svg");
  EXPECT_CONTAINS(folder.read("a.svg"), "> 900<") << "the numbers stand under the short one";
  figure.log_x = true;
  write_figure(figure, folder / "log.svg");
  EXPECT_CONTAINS(folder.read("log.svg"), ">3<");
}

TEST(Figure, ValuesThatAreNotFiniteAreGaps) {
  const TemporaryFolder folder;
  write_figure(figure_of({"", {0, 1, 2, 3, nan, 5}, {1, nan, infinity, 2, 3, -infinity}}),
               folder / "gaps.svg");
  write_figure(figure_of({"", {0, 1, 2}, {4, 4, 4}}), folder / "level.svg");
  write_figure(figure_of({"", {1}, {1e300}}), folder / "point.svg");
  EXPECT_EQ(folder.entries(), 3u);
}

TEST(Figure, LogarithmicAxesShowWhatIsAboveZero) {
  const TemporaryFolder folder;
  Figure figure = figure_of({"error", {1, 10, 100, 1000, -1}, {1e-9, 0, -3, 1e-3, 1}, false, true});
  figure.panels[0].marks.clear();
  figure.panels[0].log_y = figure.log_x = true;
  write_figure(figure, folder / "both.svg");
  const std::string both = folder.read("both.svg");
  // Powers of ten: the exponent is a text of its own.
  for (const char* text : {">10<", ">-8<", ">-4<", ">3<"}) EXPECT_CONTAINS(both, text);
  figure.panels.push_back({"linear", {line}, {}});
  write_figure(figure, folder / "one.svg");
  EXPECT_CONTAINS(folder.read("one.svg"), ">-8<");
  EXPECT_CONTAINS(folder.read("one.svg"), "> 2.5<");
  figure.panels = {{"within a decade", {{"", {1, 2}, {2e-7, 3e-7}}}, {}, std::nullopt, true}};
  write_figure(figure, folder / "narrow.svg");
  for (const char* text : {">-7<", ">-6<"}) EXPECT_CONTAINS(folder.read("narrow.svg"), text);
  figure.panels = {{"nothing above 0", {{"", {1, 2}, {0, -1}}}, {}, std::nullopt, true}};
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_figure(figure, folder / "none.svg"); }),
                  "could not draw");
}

TEST(Figure, TheLegendMayStandBesideTheCurves) {
  const TemporaryFolder folder;
  Figure figure = figure_of(line);
  write_figure(figure, folder / "over.svg");
  figure.legend_beside = true;
  write_figure(figure, folder / "beside.svg");
  EXPECT_NE(folder.read("over.svg"), folder.read("beside.svg"));
  EXPECT_CONTAINS(folder.read("beside.svg"), ">line<");
}

TEST(Figure, PointsAreMarked) {
  const TemporaryFolder folder;
  Series marked = line;
  marked.points = true;
  write_figure(figure_of(line), folder / "line.svg");
  write_figure(figure_of(marked), folder / "points.svg");
  const auto marks_of = [&](const char* name) {
    const std::string svg = folder.read(name);
    std::size_t count = 0;
    for (std::size_t at = svg.find("#gpPt6"); at != std::string::npos; at = svg.find("#gpPt6", at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(marks_of("line.svg"), 0u);
  EXPECT_EQ(marks_of("points.svg"), 4u) << "three values and the legend";
}

TEST(Figure, OtherEndingsMissingFoldersAndNothingToDrawAreRefused) {
  const TemporaryFolder folder;
  for (const char* name : {"a.gif", "a", "a.SVG", "svg", ".svg", "a.svg.part"})
    EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_figure(figure_of(line), folder / name); }),
                    "must end in .svg or .png");
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_figure(figure_of(line), folder / "no/a.svg"); }),
                  "no does not exist");
  Figure empty = figure_of(line);
  empty.panels[0].series.clear();
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_figure(empty, folder / "a.svg"); }),
                  "nothing to draw");
  empty.panels.clear();
  EXPECT_CONTAINS(thrown_message<FigureError>([&] { write_figure(empty, folder / "a.svg"); }),
                  "nothing to draw");
  EXPECT_EQ(folder.entries(), 0u);
}

// Titles and column names come from files that others make.
TEST(Figure, TextIsOnlyText) {
  const TemporaryFolder folder;
  const std::string touch = "touch " + (folder / "done").string();
  const std::string text =
      "`" + touch + "` \"; system(\"" + touch + "\") # ' . system('" + touch + "') \\ \n set output $d0 @x";
  Figure figure = figure_of(line);
  figure.title = figure.x_label = text;
  figure.panels[0].y_label = figure.panels[0].series[0].label = figure.panels[0].marks[0].label = text;
  write_figure(figure, folder / "it's `a` \"name\".svg");
  EXPECT_FALSE(std::filesystem::exists(folder / "done"));
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_CONTAINS(folder.read("it's `a` \"name\".svg"), "`touch");
}

}  // namespace kmax::plot::figure_test
