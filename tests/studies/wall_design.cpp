#include "tests/studies/wall_design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "host_tools/experiment/job_pool.hpp"

namespace kmax::studies {
namespace {

using experiment::DesignTask;
using experiment::WallFamily;

std::string in_n_per_mm(double stiffness) {
  return fmt::format("{:.2f}", stiffness / 1e3);
}

GridOptimum optimum_of(const DesignTask& task, const WallGrid& grid, const WallFamily& family, int floor) {
  experiment::WallTrials trials(task);
  std::vector<std::size_t> touches(task.touches());
  std::iota(touches.begin(), touches.end(), 0U);
  GridOptimum best{floor};
  bool found = false;
  const auto holds = [&](double damping, int rung) {
    return !trials.first_not_held({family, damping, grid.stiffness(rung)}, touches);
  };
  for (const double damping : grid.dampings) {
    const int steps = best.rung < grid.first ? 0 : (best.rung - grid.first) / grid.step + 1;
    const int better = grid.first + steps * grid.step;
    if (better > experiment::top_rung || !holds(damping, better)) continue;
    int rung = grid.first;
    while (rung <= experiment::top_rung && (rung == better || holds(damping, rung))) rung += grid.step;
    rung -= grid.step;
    if (rung < better) continue;
    found = true;
    best.rung = rung;
    best.family = family;
    best.damping = damping;
  }
  if (!found) best.rung = -1;
  best.touches = trials.touches();
  return best;
}

}  // namespace

double WallGrid::stiffness(int rung) const {
  return experiment::stiffness_of(rung) * (between ? std::sqrt(experiment::rung_ratio) : 1.0);
}

WallGrid fine_grid(const DesignTask& task, bool between) {
  const std::vector<double> coarse = experiment::dampings_of(task);
  WallGrid grid{{0.0}};
  grid.between = between;
  for (std::size_t n = 1; n < coarse.size(); ++n)
    for (int part = 0; part < 8; ++part)
      grid.dampings.push_back(coarse[n] *
                              std::pow(experiment::damping_ratio, (part - (between ? 7.5 : 7.0)) / 8.0));
  return grid;
}

GridOptimum grid_optimum(const DesignTask& task, const WallGrid& grid, int floor,
                         const experiment::DesignRun& run) {
  const std::vector<WallFamily> families = experiment::families_of(task);
  const auto found = experiment::collect_jobs<GridOptimum>(
      families.size(), run.threads, [&](std::size_t n) { return optimum_of(task, grid, families[n], floor); },
      run.progress);
  GridOptimum best;
  std::uint64_t touches = 0;
  for (const GridOptimum& one : found) {
    touches += one.touches;
    if (one.rung > best.rung) best = one;
  }
  best.touches = touches;
  const int rungs = (std::max(best.rung, floor) - grid.first) / grid.step + 1;
  best.points = families.size() * grid.dampings.size() * static_cast<std::uint64_t>(std::max(rungs, 0));
  return best;
}

DesignTask random_device(std::uint64_t seed) {
  // The engine's numbers are fixed by the standard, those of its distributions are not.
  std::mt19937_64 random(seed);
  const auto share = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
  const auto between = [&share](double least, double most) {
    return least * std::pow(most / least, share());
  };
  DesignTask task;
  task.set = experiment::open_subject_set("clipped");
  simulation::DeviceModel& device = task.set.device;
  device.mass = between(0.02, 0.2);
  device.damping = between(0.01, 0.5);
  device.friction = between(0.02, 0.3);
  device.force_limit = between(2.5, 20.0);
  if (share() < 0.5) device.delay = between(0.1e-3, 1e-3);
  if (share() < 0.5) simulation::bend(device, between(2e3, 5e4));
  task.rate = share() < 0.5 ? 500.0 : 1000.0;
  task.count_length = between(5e-6, 100e-6);
  return task;
}

report::Table compare_designs(std::uint64_t first, std::uint64_t devices, bool between,
                              const experiment::DesignRun& run,
                              const std::function<void(const std::string&)>& say) {
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
    const WallGrid looked_at = fine_grid(task, between);
    const GridOptimum grid = grid_optimum(task, looked_at, rung - below, run);
    const double best = looked_at.stiffness(grid.rung < 0 ? rung - below : grid.rung);
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
    say(fmt::format("{}: {}, {} N s/m; grid {}, {} N s/m, {} touches", seed, name_of(design.wall.family),
                    design.wall.damping, name_of(grid.family), grid.damping, grid.touches));
  }
  return table;
}

}  // namespace kmax::studies
