
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/plot/figure.hpp"
#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::wall {

ForceCurve force_curve(const firmware::ParameterValues& values, std::size_t axis, double approach_speed) {
  const WallEvaluator evaluator(values, axis);
  const double surface = static_cast<double>(values.real<"wall.position">(axis));
  const double side = values.whole<"wall.side">(axis);
  const double field = static_cast<double>(values.real<"wall.magnetic_length">(axis));
  const double stiffness = static_cast<double>(values.real<"wall.stiffness">(axis));
  const double inside = stiffness > 0 ? std::min(3.0 / stiffness, 4 * field) : field;
  ForceCurve curve;
  constexpr int points = 600;
  for (int i = 0; i <= points; ++i) {
    const double distance = -inside + (4 * field + inside) * i / points;
    curve.distance.push_back(distance);
    curve.force.push_back(side * evaluator.at(surface + side * distance, -side * approach_speed).force);
  }
  return curve;
}

void write_force_curves(const firmware::ParameterValues& values, std::size_t axis,
                        const std::filesystem::path& picture) {
  plot::Figure figure;
  figure.title =
      fmt::format("Wall laws, K = {:g} N/mm, x_0 = {:g} mm", values.real<"wall.stiffness">(axis) / 1000.0f,
                  values.real<"wall.magnetic_length">(axis) * 1000.0f);
  figure.x_label = "distance outside the surface (mm); negative is inside";
  figure.panels = {{"force outwards (N)", {}, {{0.0, true, "surface"}}}};
  for (const auto& [name, law] : firmware::names::wall_law) {
    const auto kind = static_cast<control::WallKind>(law);
    if (kind == control::WallKind::none) continue;
    firmware::ParameterValues of_law = values;
    of_law.set_whole<"wall.law">(law, axis);
    const WallEvaluator evaluator(of_law, axis);
    const auto add = [&](double approach_speed, std::string label) {
      ForceCurve curve = force_curve(of_law, axis, approach_speed);
      for (double& distance : curve.distance) distance *= 1e3;
      figure.panels[0].series.push_back(
          {std::move(label), std::move(curve.distance), std::move(curve.force), false});
    };
    const double surface = static_cast<double>(values.real<"wall.position">(axis));
    const double coefficient = std::abs(evaluator.at(surface, 0).magnetic_force);
    if (control::follows_velocity(kind)) {
      add(0, fmt::format("{}, at rest", name));
      add(0.5, fmt::format("{}, approaching at 0.5 m/s", name));
    } else {
      add(0, coefficient > 0 ? fmt::format("{}, F_MC = {:g} N", name, coefficient) : std::string(name));
    }
  }
  plot::write_figure(figure, picture);
}

}  // namespace kmax::wall
