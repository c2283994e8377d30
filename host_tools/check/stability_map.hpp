#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/check/case_judgement.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/plot/map_figure.hpp"

namespace kmax::check {

/// The values of one parameter along one side of a map.
struct MapAxis {
  device::Parameter parameter;
  double from, to;
  bool logarithmic = false;
  std::size_t points = 60;

  double at(std::size_t i) const;
};

/// "wall.stiffness=0.1N/mm..10N/mm:log,80": NAME=FROM..TO, then :log for equal ratios, then ,POINTS
/// (2 .. 1000, 60 without). FROM and TO with units as `kmax set` takes them, within the parameter's range,
/// FROM below TO, above 0 for log. Errors: base::ValueError that says what is allowed; also for parameters
/// that are no real numbers, or only read.
MapAxis parse_map_axis(std::string_view text, std::size_t default_axis);

/// All criteria at every point of two parameters.
struct StabilityMap {
  MapAxis x, y;
  std::vector<Results> results;  ///< y.points rows of x.points
  Structure structure{};         ///< the same at every point

  const Results& at(std::size_t column, std::size_t row) const { return results[row * x.points + column]; }
};

/// Rules between parameters (haptic.rate divides 20000 Hz) are not asked for: the map is of the criteria.
/// Throws base::ValueError if both sides are the same parameter.
StabilityMap map_stability(const firmware::ParameterValues& values, std::size_t axis,
                           const control::Hand<double>& hand, const MapAxis& x, const MapAxis& y,
                           const Structure& structure = {});

/// One row per point: the two parameters, whether all criteria pass, and each criterion; 1 passes, 0 fails,
/// empty where it does not apply. Throws std::runtime_error if the file cannot be written.
void write_map_csv(const StabilityMap& map, const std::filesystem::path& path);

/// Where the bounds run and what lies between them, in the parameters' values.
struct MapOutlines {
  std::vector<plot::Outline> all_met;   ///< polygons: every criterion that applies passes
  std::vector<plot::Outline> unstable;  ///< polygons: the linear loop is unstable
  std::vector<std::pair<control::Criterion, std::vector<plot::Outline>>>
      bounds;  ///< strokes; of all criteria
};
MapOutlines outlines_of(const StabilityMap& map);

/// Draws where each criterion's bound runs, the regions between, and the present set as a point. False if
/// that lies outside of the map. Throws plot::FigureError.
bool write_map_picture(const StabilityMap& map, const firmware::ParameterValues& values,
                       const std::string& hand, const std::filesystem::path& path);

}  // namespace kmax::check
