#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "host_tools/check/criterion_text.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/check/map_contour.hpp"
#include "host_tools/check/stability_map.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/plot/map_figure.hpp"

namespace kmax::check {

using control::CriterionResult;
using device::Parameter;

namespace {
/// Positive where a criterion passes, 0 at its bound, within +-1; smooth over decades.
double nearness(const CriterionResult<double>& result) {
  if (!result.applies) return std::numeric_limits<double>::quiet_NaN();
  const double sign = result.pass ? 1.0 : -1.0;
  if (is_infinite(result.value) || is_infinite(result.bound) || result.value < 0 || result.bound <= 0)
    return sign;
  const double share = std::abs(result.bound - result.value) / (result.bound + result.value);
  return sign * std::max(share, 1e-12);
}

template <typename Number>
Field field_of(const StabilityMap& map, Number number) {
  Field field{map.x.points, map.y.points, {}};
  for (const Results& results : map.results) field.values.push_back(number(results));
  return field;
}

double nearness_of_all(const Results& results) {
  double least = 1;
  for (const auto& result : results) {
    if (result.applies) least = std::min(least, nearness(result));
  }
  return least;
}

/// From grid coordinates to the parameters' values.
void to_values(std::vector<plot::Outline>& outlines, const StabilityMap& map) {
  const auto value = [](const MapAxis& axis, double place) {
    const double share = place / static_cast<double>(axis.points - 1);
    return axis.logarithmic ? axis.from * std::pow(axis.to / axis.from, share)
                            : axis.from + (axis.to - axis.from) * share;
  };
  for (plot::Outline& outline : outlines) {
    for (double& x : outline.x) x = value(map.x, x);
    for (double& y : outline.y) y = value(map.y, y);
  }
}

std::string label_of(const Parameter& parameter) {
  const std::string_view unit = parameter.definition().unit;
  return unit.empty() ? parameter.name() : fmt::format("{} ({})", parameter.name(), unit);
}

double present(const MapAxis& axis, const firmware::ParameterValues& values) {
  return static_cast<double>(
      std::bit_cast<float>(values.raw(firmware::slot_of(axis.parameter.entry(), axis.parameter.axis()))));
}

/// What the map holds still, as far as it matters to most criteria.
std::string title_of(const StabilityMap& map, const firmware::ParameterValues& values,
                     const std::string& hand) {
  const std::size_t axis = map.x.parameter.axis();
  std::string title;
  for (const Parameter& parameter : {Parameter::of<"wall.law">(axis), Parameter::of<"wall.stiffness">(axis),
                                     Parameter::of<"haptic.rate">(axis), Parameter::of<"guard.damping">(axis),
                                     Parameter::of<"guard.friction">(axis)}) {
    if (parameter == map.x.parameter || parameter == map.y.parameter) continue;
    title += fmt::format("{} {}, ", parameter.name(),
                         device::value_with_unit(
                             parameter, values.raw(firmware::slot_of(parameter.entry(), parameter.axis()))));
  }
  if (map.structure)
    title += fmt::format("structure {:g} N/m, tip {:g} kg, ", map.structure->stiffness,
                         map.structure->handle_mass);
  return title + "hand " + hand;
}
}  // namespace

MapOutlines outlines_of(const StabilityMap& map) {
  const auto unstable = [](const Results& results) {
    return -nearness(results[static_cast<std::size_t>(control::Criterion::sampled_eigenvalues)]);
  };
  MapOutlines outlines{
      positive_area(field_of(map, nearness_of_all)), positive_area(field_of(map, unstable)), {}};
  to_values(outlines.all_met, map);
  to_values(outlines.unstable, map);
  for (const CriterionText& text : all_criteria()) {
    const auto number = static_cast<std::size_t>(text.criterion);
    auto strokes = zero_lines(field_of(map, [number](const Results& r) { return nearness(r[number]); }));
    to_values(strokes, map);
    outlines.bounds.emplace_back(text.criterion, std::move(strokes));
  }
  return outlines;
}

bool write_map_picture(const StabilityMap& map, const firmware::ParameterValues& values,
                       const std::string& hand, const std::filesystem::path& path) {
  plot::MapFigure figure;
  figure.title = title_of(map, values, hand);
  figure.x_label = label_of(map.x.parameter);
  figure.y_label = label_of(map.y.parameter);
  figure.x_limits = {map.x.from, map.x.to};
  figure.y_limits = {map.y.from, map.y.to};
  figure.log_x = map.x.logarithmic;
  figure.log_y = map.y.logarithmic;

  MapOutlines outlines = outlines_of(map);
  figure.regions = {{"all criteria met", "#cfe5f5", std::move(outlines.all_met)},
                    {"linear loop unstable", "#d4d4d4", std::move(outlines.unstable)}};
  for (auto& [criterion, strokes] : outlines.bounds) {
    const CriterionText& text = text_of(criterion);
    figure.lines.push_back({fmt::format("{} ({})", text.name(), name_of(text.worth)), std::move(strokes),
                            static_cast<std::size_t>(criterion)});
  }
  const double x = present(map.x, values), y = present(map.y, values);
  if (map.x.from <= x && x <= map.x.to && map.y.from <= y && y <= map.y.to)
    figure.point = plot::MapPoint{"present parameters", x, y};
  plot::write_map_figure(figure, path);
  return figure.point.has_value();
}

}  // namespace kmax::check
