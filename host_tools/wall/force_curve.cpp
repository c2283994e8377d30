
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/plot/figure.hpp"
#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::wall {

namespace {
plot::Series curve(const firmware::ParameterValues& values, std::size_t axis, const WallEvaluator& evaluator,
                   double approach_speed, std::string label) {
  const double surface = static_cast<double>(values.real<"wall.position">(axis));
  const double side = values.whole<"wall.side">(axis);
  const double field = static_cast<double>(values.real<"wall.magnetic_length">(axis));
  // From inside, where about 3 N of spring have built up, to where 4 % of the field is left.
  const double stiffness = static_cast<double>(values.real<"wall.stiffness">(axis));
  const double inside = stiffness > 0 ? std::min(3.0 / stiffness, 4 * field) : field;
  plot::Series series{std::move(label), {}, {}, false};
  constexpr int points = 600;
  for (int i = 0; i <= points; ++i) {
    const double distance = -inside + (4 * field + inside) * i / points;
    series.x.push_back(distance * 1e3);
    series.y.push_back(side * evaluator.at(surface + side * distance, -side * approach_speed).force);
  }
  return series;
}
}  // namespace

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
      figure.panels[0].series.push_back(curve(values, axis, evaluator, approach_speed, std::move(label)));
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
