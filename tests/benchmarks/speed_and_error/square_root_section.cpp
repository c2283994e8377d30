#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

// 1/sqrt(x) from the number's bits, halved exponent, with `steps` of Newton's method; then times x.
template <int steps>
float by_bits(float x) {
  float y = std::bit_cast<float>(0x5F37'59DFU - (std::bit_cast<std::uint32_t>(x) >> 1));
  for (int n = 0; n < steps; ++n) y = y * (1.5F - 0.5F * x * y * y);
  return x * y;
}

// Evenly spread over the logarithm from 1e-6 to 1e6.
std::vector<float> arguments() {
  std::vector<float> values;
  for (int n = 0; n < 100'000; ++n)
    values.push_back(static_cast<float>(std::pow(10.0, -6.0 + 12.0 * n / 1e5)));
  return values;
}

struct RootResult {
  double largest = 0.0, root_mean_square = 0.0;  // relative
  double ulps = 0.0;                             // largest
  double nanoseconds = 0.0;                      // one after the other
};

template <typename Scalar, typename Function>
RootResult measure(const std::vector<float>& values, Function function) {
  ErrorStatistics relative, ulps;
  for (const float value : values) {
    const long double truth = std::sqrt(static_cast<long double>(value));
    const auto error = static_cast<long double>(function(static_cast<Scalar>(value))) - truth;
    relative.add(error / truth);
    ulps.add(error / unit_in_last_place<Scalar>(truth));
  }
  const double seconds = best_processor_time(9, [&] {
    // The next argument waits for this root, as in a tick, where nothing else is there to do meanwhile.
    Scalar last{};
    for (const float value : values) last = function(static_cast<Scalar>(value) + last * Scalar(1e-30F));
    keep(last);
  });
  return {relative.largest(), relative.root_mean_square(), ulps.largest(),
          1e9 * seconds / static_cast<double>(values.size())};
}

}  // namespace

report::Section square_root_section(const std::filesystem::path& pictures) {
  report::Section section;
  section.heading = "Square root";
  section.paragraphs = {
      "Compared: the square root of the processor in float, which control/ uses (one VSQRT.F32 of 14 cycles "
      "on the Cortex-M4F, and SQRTSS here; both round correctly, hence the same bits), with that in double "
      "(which the Cortex-M4F has not), and with the estimate from the bits of a float and 0 to 3 steps of "
      "Newton's method, for processors without one. Against: the root in long double; 100,000 arguments from "
      "1e-6 to 1e6, spread evenly over the logarithm. Time: each root waits for the one before, one addition "
      "and multiplication included."};
  struct RootMethod {
    const char* name;
    RootResult result;
  };
  const std::vector<float> values = arguments();
  const std::array methods{
      RootMethod{"processor's, float", measure<float>(values, [](float x) { return __builtin_sqrtf(x); })},
      RootMethod{"processor's, double", measure<double>(values, [](double x) { return __builtin_sqrt(x); })},
      RootMethod{"bits, 0 steps", measure<float>(values, by_bits<0>)},
      RootMethod{"bits, 1 step", measure<float>(values, by_bits<1>)},
      RootMethod{"bits, 2 steps", measure<float>(values, by_bits<2>)},
      RootMethod{"bits, 3 steps", measure<float>(values, by_bits<3>)}};
  report::Table table{"",
                      {"method", "largest relative error", "RMS relative error",
                       "largest (units in the last place)", "time (ns)"},
                      {}};
  plot::Figure figure;
  figure.title = "Square root: largest relative error against time";
  figure.x_label = "time for one root after the other (ns)";
  figure.legend_beside = true;
  figure.panels = {{"largest relative error", {}, {}, std::nullopt, true}};
  for (const RootMethod& method : methods) {
    const RootResult& r = method.result;
    table.rows.push_back({method.name, fmt::format("{:.2g}", r.largest),
                          fmt::format("{:.2g}", r.root_mean_square), fmt::format("{:.2g}", r.ulps),
                          fmt::format("{:.1f}", r.nanoseconds)});
    figure.panels[0].series.push_back({method.name, {r.nanoseconds}, {r.largest}, false, true});
  }
  plot::write_figure(figure, pictures / "speed_square_root.svg");
  section.tables = {table};
  section.pictures = {{figure.title, pictures / "speed_square_root.svg"}};
  return section;
}

}  // namespace kmax::benchmark
