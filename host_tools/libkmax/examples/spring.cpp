// A spring at the handle, made by this program: spring [ADDRESS]
#include <kmax/kmax.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

int main(int argc, char** argv) try {
  kmax::Device device(argc > 1 ? argv[1] : "");
  std::optional<double> rest;
  const auto spring = [&rest](const kmax::Sample& sample) -> std::optional<double> {
    rest = rest.value_or(sample.position);
    return -200.0 * (sample.position - *rest);  // N, 200 N/m
  };
  const kmax::ForceRecord record = device.force_loop({.seconds = 2.0}, spring);
  double most = 0;
  for (const kmax::ForceStep& step : record.steps) most = std::max(most, std::abs(step.force));
  std::printf("%zu cycles at %.0f Hz, up to %.2f N\n", record.steps.size(), record.rate, most);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
