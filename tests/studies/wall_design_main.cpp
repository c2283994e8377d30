// kmax-wall-design-study: designs walls for random devices, and compares them with a fine grid.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdio>

#include "host_tools/report/page.hpp"
#include "tests/studies/wall_design.hpp"

namespace kmax::studies {
namespace {

std::string in_n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}

int run(int count, char** arguments) {
  CLI::App app("Walls of 'kmax design wall' against a fine grid, on random devices");
  std::uint64_t first = 1, devices = 10;
  experiment::DesignRun run;
  app.add_option("--first", first, "Seed of the first device")->capture_default_str();
  app.add_option("--devices", devices, "How many")->capture_default_str();
  app.add_option("--jobs", run.threads, "Searches at a time; all processors without it");
  CLI11_PARSE(app, count, arguments);
  // How far below the design the grid is looked at.
  constexpr int below = 5;
  report::Table table{"",
                      {"device", "kg", "N", "ms", "structure, N/mm", "Hz", "um", "N limit", "design, N/mm",
                       "grid, N/mm", "design / grid", "touches", "of the grid's"},
                      {}};
  for (std::uint64_t seed = first; seed < first + devices; ++seed) {
    const experiment::DesignTask task = random_device(seed);
    const simulation::DeviceModel& device = task.set.device;
    const experiment::WallDesign design = experiment::design_wall(task, run, false);
    const int rung = design.found
                         ? static_cast<int>(std::lround(std::log(design.largest / experiment::first_rung) /
                                                        std::log(experiment::rung_ratio)))
                         : -1;
    const GridOptimum grid = grid_optimum(task, fine_grid(task), rung - below, run);
    const double best =
        grid.rung < 0 ? experiment::stiffness_of(rung - below) : experiment::stiffness_of(grid.rung);
    table.rows.push_back({std::to_string(seed), fmt::format("{:.3f}", device.mass),
                          fmt::format("{:.2f}", device.friction), fmt::format("{:.2f}", device.delay * 1e3),
                          device.structure ? in_n_per_mm(device.structure->stiffness) : "-",
                          fmt::format("{:g}", task.rate), fmt::format("{:.1f}", task.count_length * 1e6),
                          fmt::format("{:.1f}", device.force_limit), in_n_per_mm(design.largest),
                          fmt::format("{}{}", grid.rung < 0 ? "<" : "", in_n_per_mm(best)),
                          fmt::format("{}{:.3f}", grid.rung < 0 ? ">" : "", design.largest / best),
                          std::to_string(design.touches),
                          fmt::format("1/{:.0f}", static_cast<double>(grid.points * task.touches()) /
                                                      static_cast<double>(design.touches))});
    fmt::print("{}: {}, {} N s/m; grid {}, {} N s/m, {} touches\n", seed, name_of(design.wall.family),
               design.wall.damping, name_of(grid.family), grid.damping, grid.touches);
    std::fflush(stdout);
  }
  fmt::print("{}", report::csv(table));
  return 0;
}

}  // namespace
}  // namespace kmax::studies

int main(int count, char** arguments) {
  try {
    return kmax::studies::run(count, arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "kmax-wall-design-study: {}\n", error.what());
    return 1;
  }
}
