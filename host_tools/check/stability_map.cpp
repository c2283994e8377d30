#include "host_tools/check/stability_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/check/criterion_text.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::check {

using base::ValueError;
using device::Parameter;

namespace {
constexpr std::size_t points_max = 1000;

[[noreturn]] void refuse_form(std::string_view text) {
  throw ValueError(fmt::format(
      "--map {}: write NAME=FROM..TO, and if wanted :log and ,POINTS, as in wall.stiffness=100..10000:log,60",
      text));
}

std::size_t parse_points(std::string_view text, std::string_view whole) {
  std::size_t points = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), points);
  if (error != std::errc{} || end != text.data() + text.size() || points < 2 || points > points_max)
    throw ValueError(fmt::format("--map {}: '{}' points: allowed is a whole number from 2 to {}", whole, text,
                                 points_max));
  return points;
}

double parse_end(const Parameter& parameter, std::string_view text) {
  const std::uint32_t raw = device::parse_value(parameter, text);
  return base::shortest_double(std::bit_cast<float>(raw));
}
}  // namespace

double MapAxis::at(std::size_t i) const {
  const double share = static_cast<double>(i) / static_cast<double>(points - 1);
  if (i + 1 == points) return to;
  return logarithmic ? from * std::pow(to / from, share) : from + (to - from) * share;
}

MapAxis parse_map_axis(std::string_view text, std::size_t default_axis) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) refuse_form(text);
  const Parameter parameter = device::resolve(text.substr(0, equals), default_axis);
  const firmware::Entry& entry = parameter.definition();
  if (!parameter.writable())
    throw ValueError(fmt::format("--map: {} can only be read; a map needs a setting", parameter.name()));
  if (entry.type != firmware::Type::float32)
    throw ValueError(fmt::format("--map: {} is not a real number ({}); --set sets it for the whole map",
                                 parameter.name(), device::allowed_text(parameter)));
  std::string_view range = text.substr(equals + 1);
  MapAxis axis{parameter, 0, 0};
  if (const std::size_t comma = range.rfind(','); comma != std::string_view::npos) {
    axis.points = parse_points(range.substr(comma + 1), text);
    range = range.substr(0, comma);
  }
  if (const std::size_t colon = range.find(':'); colon != std::string_view::npos) {
    if (range.substr(colon) != ":log")
      throw ValueError(
          fmt::format("--map {}: '{}' is not known; allowed is :log", text, range.substr(colon)));
    axis.logarithmic = true;
    range = range.substr(0, colon);
  }
  const std::size_t dots = range.find("..");
  if (dots == std::string_view::npos) refuse_form(text);
  axis.from = parse_end(parameter, range.substr(0, dots));
  axis.to = parse_end(parameter, range.substr(dots + 2));
  if (!(axis.from < axis.to))
    throw ValueError(fmt::format("--map {}: from {} to {} is no range; FROM must be below TO", text,
                                 base::number_text(axis.from), base::number_text(axis.to)));
  if (axis.logarithmic && !(axis.from > 0))
    throw ValueError(fmt::format("--map {}: a logarithmic side cannot begin at {}; FROM must be above 0",
                                 text, base::number_text(axis.from)));
  return axis;
}

StabilityMap map_stability(const firmware::ParameterValues& values, std::size_t axis,
                           const control::Hand<double>& hand, const MapAxis& x, const MapAxis& y,
                           const Structure& structure) {
  if (x.parameter == y.parameter)
    throw ValueError(fmt::format("--map: both sides are {}; name two parameters", x.parameter.name()));
  StabilityMap map{x, y, {}, structure};
  map.results.reserve(x.points * y.points);
  firmware::ParameterValues at_point = values;
  const auto set = [&at_point](const Parameter& parameter, double value) {
    at_point.set_raw(firmware::slot_of(parameter.entry(), parameter.axis()),
                     std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  };
  for (std::size_t row = 0; row < y.points; ++row) {
    set(y.parameter, y.at(row));
    for (std::size_t column = 0; column < x.points; ++column) {
      set(x.parameter, x.at(column));
      map.results.push_back(judge_all(parameter_case(at_point, axis, hand), structure));
    }
  }
  return map;
}

void write_map_csv(const StabilityMap& map, const std::filesystem::path& path) {
  std::string text = fmt::format("{},{},all", map.x.parameter.name(), map.y.parameter.name());
  for (const CriterionText& criterion : all_criteria()) text += fmt::format(",{}", criterion.name());
  text += '\n';
  for (std::size_t row = 0; row < map.y.points; ++row) {
    for (std::size_t column = 0; column < map.x.points; ++column) {
      const Results& results = map.at(column, row);
      const bool all = std::all_of(results.begin(), results.end(), [](const auto& r) { return r.pass; });
      text += fmt::format("{},{},{}", map.x.at(column), map.y.at(row), all ? 1 : 0);
      for (const auto& result : results) text += !result.applies ? "," : result.pass ? ",1" : ",0";
      text += '\n';
    }
  }
  base::write_file(path, text);
}

}  // namespace kmax::check
