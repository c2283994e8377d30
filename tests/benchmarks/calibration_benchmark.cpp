// Calibrates the five motor scenes with many seeds of sensor noise and prints the worst error of each value:
//
//   calibration_benchmark [SEEDS]      20 without an argument
//
// Exit code 1 if a calibration failed or an error is beyond its bound (procedure_accuracy.hpp).

#include <fmt/format.h>

#include <cstdlib>
#include <vector>

#include "tests/host_tools/calibration/procedure_accuracy.hpp"

int main(int count, char** arguments) {
  using namespace kmax;
  using calibration_test::Judged;
  const int seeds = count > 1 ? std::atoi(arguments[1]) : 20;
  if (seeds < 1) {
    fmt::print(stderr, "calibration_benchmark: {} seeds; 1 or more are needed\n", arguments[1]);
    return 2;
  }
  bool good = true;
  fmt::print("| scene | value | truth | worst error of {} | bound |\n|---|---|---|---|---|\n", seeds);
  for (const char* scene : calibration_test::motor_scenes) {
    std::vector<Judged> worst;
    for (int seed = 1; seed <= seeds; ++seed) {
      calibration_test::CalibratedDevice device(scene, static_cast<std::uint64_t>(seed));
      const auto report = device.calibrate();
      if (!report.pass()) {
        fmt::print("| {} | seed {} failed: {} | | | |\n", scene, seed, calibration_test::cause_of(report));
        good = false;
        continue;
      }
      const std::vector<Judged> judged = calibration_test::judge(device, report);
      if (worst.empty()) worst = judged;
      for (std::size_t i = 0; i < judged.size(); ++i) {
        if (!(judged[i].error() <= worst[i].error())) worst[i] = judged[i];
      }
    }
    for (const Judged& one : worst) {
      good = good && one.good();
      fmt::print(
          "| {} | {} | {:.5g} | {} | {} |\n", scene, one.name, one.truth,
          one.absolute ? fmt::format("{:.4f}", one.error()) : fmt::format("{:.2f} %", 100.0 * one.error()),
          one.absolute ? fmt::format("{:.4f}", one.allowed) : fmt::format("{:.0f} %", 100.0 * one.allowed));
    }
  }
  return good ? 0 : 1;
}
