#pragma once
// What is said of a designed wall.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/design/wall_design.hpp"

namespace kmax::experiment {

/// Sentences: the wall, what bounds it, its price, what would buy more. Of one that was not found: why, and
/// what to change.
std::vector<std::string> wall_design_words(const DesignTask& task, const WallDesign& design);

/// A file for 'kmax load': the wall's parameters under a comment on where they come from.
std::string wall_design_file(const DesignTask& task, const WallDesign& design);

/// Stiffness against damping, an upper bound by the touches that ended walls, of the wall's family and of its
/// field with `difference` and `foaw`; the wall is marked. Throws plot::FigureError.
void draw_wall_design(const DesignTask& task, const WallDesign& design, const DesignRun& run,
                      const std::filesystem::path& file);

}  // namespace kmax::experiment
