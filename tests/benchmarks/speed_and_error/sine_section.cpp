#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

#include "control/sine_cosine.hpp"
#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using control::SineCosine;
using control::TurnFraction;

constexpr double radians_per_unit = 2.0 * std::numbers::pi / 4294967296.0;

// Folded onto [-45, 45] degrees in whole numbers: right to the last bit near zeros too.
SineCosine<long double> exact(TurnFraction angle) {
  const std::uint32_t quadrant = (angle + 0x2000'0000U) >> 30;
  const auto rest = static_cast<std::int32_t>(angle - (quadrant << 30));
  const long double radians =
      static_cast<long double>(rest) * (2.0L * std::numbers::pi_v<long double> / 4294967296.0L);
  const long double s = std::sin(radians), c = std::cos(radians);
  switch (quadrant & 3U) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

template <typename Scalar>
SineCosine<Scalar> by_library(TurnFraction angle) {
  // Signed: half the turn's error in the angle that float can hold.
  const auto radians =
      static_cast<Scalar>(static_cast<double>(static_cast<std::int32_t>(angle)) * radians_per_unit);
  return {std::sin(radians), std::cos(radians)};
}

// Spread evenly over the turn, in an order without pattern (the golden section of 2^32).
TurnFraction nth_angle(std::uint32_t n) {
  return n * 2654435769U;
}

struct SineResult {
  ErrorStatistics errors;    // absolute
  double ulps = 0.0;         // largest, in units in the last place of the true value
  double nanoseconds = 0.0;  // for both
};

template <typename Scalar, typename Function>
SineResult measure(Function function) {
  SineResult result;
  for (std::uint32_t n = 0; n < 1'000'000; ++n) {
    const TurnFraction angle = nth_angle(n);
    const SineCosine<long double> truth = exact(angle);
    const SineCosine<Scalar> value = function(angle);
    for (const auto& [is, should] : {std::pair(static_cast<long double>(value.sine), truth.sine),
                                     std::pair(static_cast<long double>(value.cosine), truth.cosine)}) {
      result.errors.add(is - should);
      if (should != 0.0L)
        result.ulps = std::max(
            result.ulps, static_cast<double>(std::fabs(is - should) / unit_in_last_place<Scalar>(should)));
    }
  }
  constexpr std::uint32_t calls = 200'000;
  const double seconds = best_processor_time(7, [&] {
    Scalar sum{};
    for (std::uint32_t n = 0; n < calls; ++n) {
      const SineCosine<Scalar> value = function(nth_angle(n));
      sum += value.sine + value.cosine;
    }
    keep(sum);
  });
  result.nanoseconds = 1e9 * seconds / calls;
  return result;
}

}  // namespace

report::Section sine_section(const std::filesystem::path& pictures) {
  report::Section section;
  section.heading = "Sine and cosine";
  section.paragraphs = {
      "Compared: control/sine_cosine.hpp (a table of 512 angles and a short series for the rest) and its "
      "first-order variant, with std::sin and std::cos of this computer's C library, each from an angle that "
      "is a fraction of a turn in 32 bits, as the firmware has it. Against: sine and cosine in long double "
      "of the same angle, folded into +-45 degrees without rounding; a million angles all over the turn. The "
      "C library's arguments are radians, whose rounding to float is part of its error.",
      "Errors are given absolute, in units of the last place of numbers from 1/2 to 1 (2^-24 in float, 2^-53 "
      "in double), and, in one column, in units of the last place of each true value: next to a zero the "
      "relative error is larger, the library's by the rounding of its argument near half a turn. Time: both "
      "functions together, calls that do not wait for each other, on this computer; current_control.md "
      "counts instructions of the target. The firmware does not use the C library's: its bits differ from "
      "one library to the next."};
  struct SineMethod {
    const char* name;
    bool is_double;
    SineResult result;
  };
  using control::sine_cosine;
  using control::sine_cosine_first_order;
  const std::array methods{
      SineMethod{"sine_cosine, float", false, measure<float>(sine_cosine<float>)},
      SineMethod{"sine_cosine_first_order, float", false, measure<float>(sine_cosine_first_order<float>)},
      SineMethod{"std::sin and std::cos, float", false, measure<float>(by_library<float>)},
      SineMethod{"sine_cosine, double", true, measure<double>(sine_cosine<double>)},
      SineMethod{"std::sin and std::cos, double", true, measure<double>(by_library<double>)}};
  report::Table table{"",
                      {"function", "largest error", "RMS error", "largest (units of 1/2 to 1)",
                       "RMS (units of 1/2 to 1)", "largest (units of the value)", "time (ns)"},
                      {}};
  plot::Figure figure;
  figure.title = "Sine and cosine: largest error against time";
  figure.x_label = "time for both (ns)";
  figure.legend_beside = true;
  figure.panels = {{"largest error", {}, {}, std::nullopt, true}};
  for (const SineMethod& method : methods) {
    const double unit = method.is_double ? 0x1p-53 : 0x1p-24;
    const SineResult& r = method.result;
    table.rows.push_back({method.name, fmt::format("{:.2g}", r.errors.largest()),
                          fmt::format("{:.2g}", r.errors.root_mean_square()),
                          fmt::format("{:.3g}", r.errors.largest() / unit),
                          fmt::format("{:.3g}", r.errors.root_mean_square() / unit),
                          fmt::format("{:.3g}", r.ulps), fmt::format("{:.1f}", r.nanoseconds)});
    figure.panels[0].series.push_back({method.name, {r.nanoseconds}, {r.errors.largest()}, false, true});
  }
  plot::write_figure(figure, pictures / "speed_sine_cosine.svg");
  section.tables = {table};
  section.pictures = {{figure.title, pictures / "speed_sine_cosine.svg"}};
  return section;
}

}  // namespace kmax::benchmark
