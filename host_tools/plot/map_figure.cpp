#include "host_tools/plot/map_figure.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace kmax::plot {

namespace {

// Okabe and Ito's palette without its yellow, which white swallows, then two dark ones that stand apart from
// it.
constexpr std::array line_colours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00",
                                "#56B4E9", "#000000", "#7A4A1E", "#5A5A5A"};
constexpr std::size_t dash_patterns = 5;

std::string data_block(const std::string& name, const std::vector<Outline>& outlines, bool closed) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (const Outline& outline : outlines) {
    for (std::size_t i = 0; i < outline.x.size(); ++i)
      block += fmt::format("{:.6g} {:.6g}\n", outline.x[i], outline.y[i]);
    if (closed && !outline.x.empty()) block += fmt::format("{:.6g} {:.6g}\n", outline.x[0], outline.y[0]);
    block += '\n';
  }
  return block + "EOD\n";
}

/// Over few decades a logarithmic axis has 1, 2 and 5 of each written, for gnuplot's own whole powers may be
/// one.
std::string ticks(char axis, const std::pair<double, double>& limits) {
  if (limits.second / limits.first > 2e3) return "";
  std::string list;
  for (double decade = std::pow(10.0, std::floor(std::log10(limits.first))); decade <= limits.second;
       decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const double at = step * decade;
      if (at < limits.first * 0.999 || at > limits.second * 1.001) continue;
      list += fmt::format("{}'{:.6g}' {}", list.empty() ? "" : ", ", at, at);
    }
  }
  return list.empty() ? "" : fmt::format("set {}tics ({})\n", axis, list);
}

// A written value at the very end of a logarithmic axis gets lost in its rounding: a hair of room for it.
std::string range_of(char axis, const std::pair<double, double>& limits, bool logarithmic) {
  const double room = logarithmic ? 1e-9 : 0;
  return fmt::format("set {}range [{:.12g}:{:.12g}]\n", axis, limits.first * (1 - room),
                     limits.second * (1 + room));
}

std::string title_of(const std::string& label) {
  return label.empty() ? "notitle" : "title " + quoted(label);
}

std::string script_for(const MapFigure& figure) {
  std::string script =
      "set border lc rgb '#444444'\nset tics nomirror front\nset grid front lc rgb '#bbbbbb' lt 1 lw 0.5\n"
      "set key outside right top Left reverse noenhanced spacing 1.25 samplen 3.5\n";
  if (figure.log_x) script += "set logscale x 10\n" + ticks('x', figure.x_limits);
  if (figure.log_y) script += "set logscale y 10\n" + ticks('y', figure.y_limits);
  script += fmt::format("set title {} noenhanced\nset xlabel {} noenhanced\nset ylabel {} noenhanced\n",
                        quoted(figure.title), quoted(figure.x_label), quoted(figure.y_label));
  script += range_of('x', figure.x_limits, figure.log_x) + range_of('y', figure.y_limits, figure.log_y);
  std::string plots;
  const auto add = [&plots](const std::string& one) { plots += (plots.empty() ? "plot " : ", ") + one; };
  for (std::size_t i = 0; i < figure.regions.size(); ++i) {
    const MapRegion& region = figure.regions[i];
    if (region.polygons.empty()) continue;
    script += data_block(fmt::format("r{}", i), region.polygons, true);
    // The border closes the hair lines that smoothing leaves between neighbours.
    add(fmt::format(
        "$r{0} using 1:2 with filledcurves closed fs solid 1.0 border lc rgb '{1}' fc rgb '{1}' {2}", i,
        region.colour, title_of(region.label)));
  }
  for (std::size_t i = 0; i < figure.lines.size(); ++i) {
    const MapLine& line = figure.lines[i];
    if (line.strokes.empty()) continue;
    script += data_block(fmt::format("l{}", i), line.strokes, false);
    add(fmt::format("$l{} using 1:2 with lines lw 2.5 dt {} lc rgb '{}' {}", i,
                    line.style % dash_patterns + 1, line_colours[line.style % line_colours.size()],
                    title_of(line.label)));
  }
  if (figure.point) {
    script += fmt::format("$p << EOD\n{} {}\nEOD\n", figure.point->x, figure.point->y);
    add("$p using 1:2 with points pt 7 ps 1.7 lc rgb '#ffffff' notitle");
    add("$p using 1:2 with points pt 2 ps 1.4 lw 2.5 lc rgb '#000000' " + title_of(figure.point->label));
  }
  // A map without anything in it is still a map.
  if (plots.empty()) plots = "plot 1/0 notitle";
  return script + plots + "\n";
}

bool is_side(const std::pair<double, double>& limits, bool logarithmic) {
  return std::isfinite(limits.first) && std::isfinite(limits.second) && limits.first < limits.second &&
         (!logarithmic || limits.first > 0);
}

}  // namespace

void write_map_figure(const MapFigure& figure, const std::filesystem::path& path) {
  if (!is_side(figure.x_limits, figure.log_x) || !is_side(figure.y_limits, figure.log_y))
    throw FigureError(fmt::format("{}: a side of the map is no range", path.string()));
  draw_picture(script_for(figure), {1000, 560}, path);
}

}  // namespace kmax::plot
