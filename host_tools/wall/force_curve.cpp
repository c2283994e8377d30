
#include <fmt/format.h>

#include <algorithm>

#include "host_tools/plot/figure.hpp"
#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::wall {

namespace {
plot::Series curve(firmware::ParameterValues values, std::size_t axis, control::WallKind law,
                   double approach_speed, std::string label) {
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(law), axis);
  const WallEvaluator evaluator(values, axis);
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
  using control::WallKind;
  plot::Figure figure;
  figure.title =
      fmt::format("Wall laws, K = {:g} N/mm, x_0 = {:g} mm", values.real<"wall.stiffness">(axis) / 1000.0f,
                  values.real<"wall.magnetic_length">(axis) * 1000.0f);
  figure.x_label = "distance outside the surface (mm); negative is inside";
  figure.panels = {
      {"force outwards (N)",
       {curve(values, axis, WallKind::plain, 0, "plain"),
        curve(values, axis, WallKind::magnetic, 0,
              fmt::format("magnetic, F_MC = {:g} N", values.real<"wall.magnetic_coefficient">(axis))),
        curve(values, axis, WallKind::adaptive, 0, "adaptive, at rest"),
        curve(values, axis, WallKind::adaptive, 0.5, "adaptive, approaching at 0.5 m/s")},
       {{0.0, true, "surface"}}}};
  plot::write_figure(figure, picture);
}

}  // namespace kmax::wall
