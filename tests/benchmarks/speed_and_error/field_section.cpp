#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "control/wall_law.hpp"
#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using control::WallLaw;

constexpr float coefficient = 2.0F;  // F_MC, N
constexpr int per_decade = 1000;
constexpr int decades = 9;  // from 1 nm to 1 m

// As every law gets them: floats.
std::vector<float> distances() {
  std::vector<float> values;
  for (int n = 0; n <= per_decade * decades; ++n)
    values.push_back(static_cast<float>(std::pow(10.0, -9.0 + static_cast<double>(n) / per_decade)));
  return values;
}

long double exact(float distance, float length) {
  const long double ratio = static_cast<long double>(distance) / static_cast<long double>(length) + 1.0L;
  return static_cast<long double>(coefficient) / (ratio * ratio);
}

template <typename Scalar>
typename WallLaw<Scalar>::Coefficients law_of(float length) {
  control::WallLawConfig<Scalar> config;
  config.kind = control::WallKind::magnetic;
  config.magnetic_coefficient = static_cast<Scalar>(coefficient);
  config.magnetic_length = static_cast<Scalar>(length);
  return WallLaw<Scalar>::prepare(config, Scalar(0.00005));
}

template <typename Scalar>
auto wall_law(float length) {
  return [c = law_of<Scalar>(length), law = WallLaw<Scalar>()](Scalar distance) mutable {
    return law.update(c, distance, Scalar(0)).force;
  };
}

template <typename Scalar>
auto by_power(float length) {
  return [length](Scalar distance) {
    return static_cast<Scalar>(coefficient) *
           std::pow(distance / static_cast<Scalar>(length) + Scalar(1), Scalar(-2));
  };
}

struct FieldResult {
  ErrorStatistics relative;
  double largest_force = 0.0;  // N, absolute error
  double nanoseconds = 0.0;
  plot::Series curve;  // the largest in every tenth of a decade
};

template <typename Scalar, typename Function>
FieldResult measure(const std::vector<float>& values, float length, Function function) {
  FieldResult result;
  double in_bin = 0.0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const long double truth = exact(values[n], length);
    const long double error = static_cast<long double>(function(static_cast<Scalar>(values[n]))) - truth;
    result.relative.add(error / truth);
    result.largest_force = std::max(result.largest_force, static_cast<double>(std::fabs(error)));
    in_bin = std::max(in_bin, static_cast<double>(std::fabs(error / truth)));
    if (n % (per_decade / 10) == per_decade / 20) {
      result.curve.x.push_back(static_cast<double>(values[n]));
      result.curve.y.push_back(in_bin);
      in_bin = 0.0;
    }
  }
  // The next distance waits for this force: in a tick there is nothing else to do meanwhile.
  const double seconds = best_processor_time(15, [&] {
    Scalar last{};
    for (const float value : values) last = function(static_cast<Scalar>(value) + last * Scalar(1e-30F));
    keep(last);
  });
  result.nanoseconds = 1e9 * seconds / static_cast<double>(values.size());
  return result;
}

}  // namespace

report::Section field_section(const std::filesystem::path& pictures) {
  report::Section section;
  section.heading = "The field's inverse square";
  section.paragraphs = {
      "Compared: control/wall_law.hpp outside the wall, F = F_MC / (s/x_0 + 1)^2 with the reciprocal of x_0 "
      "prepared, in float (the firmware) and in double, and the same by std::pow. Against: long double, from "
      "the same distances (floats); F_MC = 2 N, distances s from 1 nm to 1 m, 1000 per decade. Time: one "
      "call of WallLaw::update, or of the formula with std::pow, on this computer; each waits for the one "
      "before, one addition and multiplication included."};
  report::Table table{"",
                      {"x_0 (mm)", "method", "largest relative error", "RMS relative error",
                       "largest error of force (N)", "time (ns)"},
                      {}};
  plot::Figure figure;
  figure.title = "Inverse-square field: largest relative error per tenth of a decade";
  figure.x_label = "distance from the wall (m)";
  figure.log_x = figure.legend_beside = true;
  figure.panels = {{"float", {}, {}, std::nullopt, true}, {"double", {}, {}, std::nullopt, true}};
  const std::vector<float> values = distances();
  for (const float length : {10e-6F, 100e-6F, 1e-3F, 10e-3F}) {
    const std::string millimetres = fmt::format("{:g}", 1e3F * length);
    const auto add = [&](const char* name, const FieldResult& r) {
      table.rows.push_back({millimetres, name, fmt::format("{:.2g}", r.relative.largest()),
                            fmt::format("{:.2g}", r.relative.root_mean_square()),
                            fmt::format("{:.2g}", r.largest_force), fmt::format("{:.1f}", r.nanoseconds)});
    };
    FieldResult in_float = measure<float>(values, length, wall_law<float>(length));
    FieldResult in_double = measure<double>(values, length, wall_law<double>(length));
    add("wall law, float", in_float);
    add("wall law, double", in_double);
    add("std::pow, float", measure<float>(values, length, by_power<float>(length)));
    add("std::pow, double", measure<double>(values, length, by_power<double>(length)));
    in_float.curve.label = in_double.curve.label = "x_0 = " + millimetres + " mm";
    figure.panels[0].series.push_back(in_float.curve);
    figure.panels[1].series.push_back(in_double.curve);
  }
  plot::write_figure(figure, pictures / "speed_field.svg");
  section.tables = {table};
  section.pictures = {{figure.title, pictures / "speed_field.svg"}};
  return section;
}

}  // namespace kmax::benchmark
