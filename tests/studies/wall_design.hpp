#pragma once
// How far `kmax design wall` stays behind a fine grid, on random devices. `kmax-studies
// wall-design` makes the numbers of docs/design_wall.md.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_tools/experiment/design/wall_design.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::studies {

struct WallGrid {
  std::vector<double> dampings;      ///< N s/m
  int first = 162, step = 2;         ///< rungs: from 100 N/m on, 2 % apart
  bool between = false;              ///< stiffnesses half a rung higher, which a design never looks at
  double stiffness(int rung) const;  ///< N/m
};
/// 0 and 192 more, 4.4 % apart, over the range that a design looks at: the dampings and stiffnesses that a
/// search looks at too, or those half a step `between` them, which it does not, so that it cannot have found
/// its best by looking where the grid does.
WallGrid fine_grid(const experiment::DesignTask& task, bool between);

struct GridOptimum {
  int rung = -1;  ///< -1: none above the floor
  experiment::WallFamily family{};
  double damping = 0.0;
  std::uint64_t touches = 0;  ///< made
  std::uint64_t points = 0;   ///< of the grid, up to the rung that was found or else the floor
};

/// The wall of the grid whose every rung from the first to its own holds for everybody by all touches, the
/// highest of all families, if it is above the rung `floor`. That is what going through the whole grid finds:
/// left out is only a wall of which one touch is unstable at the rung that would make it better than the best
/// so far.
GridOptimum grid_optimum(const experiment::DesignTask& task, const WallGrid& grid, int floor,
                         const experiment::DesignRun& run);

/// The same device and loop on every machine.
experiment::DesignTask random_device(std::uint64_t seed);

/// A row for each device of the seeds from `first` on: the design beside the best of the fine grid. `say`
/// hears a line as soon as a device is done.
report::Table compare_designs(std::uint64_t first, std::uint64_t devices, bool between,
                              const experiment::DesignRun& run,
                              const std::function<void(const std::string&)>& say);

}  // namespace kmax::studies
