#include "host_tools/plot/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace kmax::plot {

namespace {

// Okabe and Ito's palette, blue first.
constexpr std::array colours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"};
constexpr std::array point_types = {7, 5, 9, 13, 11, 6, 4, 8};
// The symbols come round at another time than the colours: fifty-six curves differ.
static_assert(std::gcd(colours.size(), point_types.size()) == 1);

bool can_be_shown(double value, bool logarithmic) {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

std::string data_block(const Series& series, std::size_t number, bool log_x, bool log_y) {
  std::string block = fmt::format("$d{} << EOD\n", number);
  for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
    if (can_be_shown(series.x[i], log_x) && can_be_shown(series.y[i], log_y)) {
      block += fmt::format("{} {}\n", series.x[i], series.y[i]);
    } else {
      block += "\n";
    }
  }
  return block + "EOD\n";
}

// From the lowest to the highest value with some air; a curve that never moves gets a height of its own.
std::string y_range(const Panel& panel) {
  if (panel.y_limits)
    return fmt::format("set yrange [{}:{}]\n", panel.y_limits->first, panel.y_limits->second);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Series& series : panel.series) {
    for (const double y : series.y) {
      if (!can_be_shown(y, panel.log_y)) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  if (low > high) return "set yrange [*:*]\n";
  if (panel.log_y) {
    // At least two powers of ten must be in sight, or the axis has no numbers.
    if (high < 100.0 * low)
      return fmt::format("set yrange [1e{:.0f}:1e{:.0f}]\n", std::floor(std::log10(0.9 * low)),
                         std::ceil(std::log10(1.1 * high)));
    const double air = std::pow(high / low, 0.06);
    return fmt::format("set yrange [{}:{}]\n", low / air, high * air);
  }
  const double span = high > low ? high - low : std::max(1.0, 0.5 * std::abs(high));
  return fmt::format("set yrange [{}:{}]\n", low - 0.06 * span, high + 0.12 * span);
}

std::string log_axis(char axis, bool logarithmic) {
  return logarithmic ? fmt::format("set logscale {0}\nset format {0} '10^{{%L}}'\n", axis)
                     : fmt::format("unset logscale {0}\nset format {0}\n", axis);
}

std::string drawn_with(const Series& series, std::size_t i) {
  if (series.points) return fmt::format("linespoints pt {} ps 0.8", point_types[i % point_types.size()]);
  return series.steps ? "steps" : "lines";
}

std::string panel_script(const Panel& panel, bool lowest, const Figure& figure, std::size_t first_block) {
  std::string script = "unset label\nunset arrow\n" + log_axis('y', panel.log_y) +
                       log_axis('x', figure.log_x) + y_range(panel);
  script += fmt::format("set ylabel {}\n", quoted(panel.y_label));
  script +=
      lowest ? fmt::format("set xlabel {}\n", quoted(figure.x_label)) : "unset xlabel\nset format x ''\n";
  for (const Mark& mark : panel.marks) {
    if (mark.vertical) {
      script +=
          fmt::format("set arrow from {0},graph 0 to {0},graph 1 nohead dt 3 lc rgb '#666666'\n", mark.at);
      script += fmt::format("set label {} at {},graph 0.94 offset 0.5,0 tc rgb '#444444'\n",
                            quoted(mark.label), mark.at);
    } else {
      script += fmt::format(
          "set arrow from graph 0,first {0} to graph 1,first {0} nohead dt 3 lc rgb '#666666'\n", mark.at);
      script += fmt::format("set label {} at graph 0.01,first {} offset 0,0.6 tc rgb '#444444'\n",
                            quoted(mark.label), mark.at);
    }
  }
  bool any_label = false;
  script += "plot ";
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    const Series& series = panel.series[i];
    any_label = any_label || !series.label.empty();
    script += fmt::format("{}$d{} using 1:2 with {} lw 1.5 dt {} lc rgb '{}' {}", i == 0 ? "" : ", ",
                          first_block + i, drawn_with(series, i), i % 5 + 1, colours[i % colours.size()],
                          series.label.empty() ? "notitle" : "title " + quoted(series.label));
  }
  return fmt::format("set key {}\n", any_label ? "on" : "off") + script + "\n";
}

// The panels share one x axis, whose numbers stand under the lowest: all must show the same part of it.
std::string x_range(const Figure& figure) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Panel& panel : figure.panels) {
    for (const Series& series : panel.series) {
      for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
        if (!can_be_shown(series.x[i], figure.log_x) || !can_be_shown(series.y[i], panel.log_y)) continue;
        low = std::min(low, series.x[i]);
        high = std::max(high, series.x[i]);
      }
    }
  }
  if (figure.panels.size() < 2 || !(low < high)) return "";
  if (!figure.log_x) return fmt::format("set xrange [{}:{}]\n", low, high);
  return fmt::format("set xrange [1e{:.0f}:1e{:.0f}]\n", std::floor(std::log10(low)),
                     std::ceil(std::log10(high)));
}

// In characters.
std::size_t longest_label(const Figure& figure) {
  std::size_t longest = 0;
  for (const Panel& panel : figure.panels) {
    for (const Series& series : panel.series) longest = std::max(longest, series.label.size());
  }
  return longest;
}

bool has_points(const Figure& figure) {
  return std::any_of(figure.panels.begin(), figure.panels.end(), [](const Panel& panel) {
    return std::any_of(panel.series.begin(), panel.series.end(), [](const Series& s) { return s.points; });
  });
}

std::string script_for(const Figure& figure) {
  const std::size_t panels = figure.panels.size();
  std::string script =
      "set grid lc rgb '#dddddd' lt 1\nset border lc rgb '#444444'\nset key top right opaque noenhanced\n";
  script += figure.legend_beside
                ? fmt::format("set key outside Left reverse\nset rmargin {}\n", 9 + longest_label(figure))
                : "set rmargin 3\n";
  // A mark on the frame would be cut in half.
  if (!figure.log_x && has_points(figure)) script += "set offsets graph 0.03,graph 0.03,0,0\n";
  script += "set lmargin 10\nset tics nomirror\n";
  script += x_range(figure);
  std::size_t block = 0;
  for (const Panel& panel : figure.panels) {
    for (const Series& series : panel.series)
      script += data_block(series, block++, figure.log_x, panel.log_y);
  }
  script += fmt::format("set multiplot layout {},1 title {} noenhanced\n", panels, quoted(figure.title));
  block = 0;
  for (std::size_t i = 0; i < panels; ++i) {
    script += panel_script(figure.panels[i], i + 1 == panels, figure, block);
    block += figure.panels[i].series.size();
  }
  return script + "unset multiplot\n";
}

}  // namespace

void write_figure(const Figure& figure, const std::filesystem::path& path) {
  if (figure.panels.empty() || std::any_of(figure.panels.begin(), figure.panels.end(),
                                           [](const Panel& p) { return p.series.empty(); }))
    throw FigureError(fmt::format("{}: there is nothing to draw", path.string()));
  const std::size_t panels = figure.panels.size();
  draw_picture(script_for(figure), {900, panels == 1 ? 480 : 120 + 200 * panels}, path);
}

}  // namespace kmax::plot
