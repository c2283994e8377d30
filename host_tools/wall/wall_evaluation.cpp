#include "host_tools/wall/wall_evaluation.hpp"

#include <fmt/format.h>

#include <iterator>
#include <stdexcept>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/plot/csv_table.hpp"

namespace kmax::wall {

namespace {

/// As it is once all of its stiffness has grown.
control::WallLawConfig<double> grown_wall(const firmware::ParameterValues& values, std::size_t axis) {
  auto wall = firmware::wall_configuration<double>(values, axis);
  wall.growing.touch_stiffness = 0.0;
  return wall;
}

}  // namespace

WallEvaluator::WallEvaluator(const firmware::ParameterValues& values, std::size_t axis)
    : coefficients_(control::WallLaw<double>::prepare(
          grown_wall(values, axis), 1.0 / static_cast<double>(values.real<"haptic.rate">(axis)))),
      position_(static_cast<double>(values.real<"wall.position">(axis))),
      side_(values.whole<"wall.side">(axis)) {}

Evaluation WallEvaluator::at(double position, double velocity) const {
  control::WallLaw<double> law;
  const auto out = law.update(coefficients_, side_ * (position - position_), side_ * velocity);
  // Adding zero turns the minus zero of a mirrored wall into a plain one.
  return {side_ * out.force + 0.0, side_ * out.magnetic_force + 0.0, out.inside};
}

EvaluatedTable evaluated_table(const WallEvaluator& evaluator, const std::filesystem::path& input) {
  const std::string position_name = "position_m", velocity_name = "velocity_m_per_s";
  const plot::CsvTable table = plot::read_csv(input, {{position_name}, {velocity_name}});
  const std::vector<double>& positions = table.column(position_name);
  const std::vector<double> velocities =
      table.has(velocity_name) ? table.column(velocity_name) : std::vector<double>(positions.size());
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "{},{},force_n\n", position_name, velocity_name);
  for (std::size_t row = 0; row < positions.size(); ++row)
    fmt::format_to(std::back_inserter(out), "{},{},{}\n", positions[row], velocities[row],
                   evaluator.at(positions[row], velocities[row]).force);
  return {fmt::to_string(out), positions.size()};
}

std::size_t evaluate_table(const WallEvaluator& evaluator, const std::filesystem::path& input,
                           const std::filesystem::path& output) {
  const EvaluatedTable table = evaluated_table(evaluator, input);
  std::error_code error;
  // The finished table takes the place of what has its name: that must not be /dev/stdout, or a folder.
  if (std::filesystem::exists(output, error) && !std::filesystem::is_regular_file(output, error))
    throw plot::CsvError(
        fmt::format("{}: is not a regular file; give the name of a file to write", output.string()));
  try {
    base::write_file(output, table.text);
  } catch (const std::runtime_error& failure) {
    throw plot::CsvError(failure.what());
  }
  return table.rows;
}

}  // namespace kmax::wall
