#pragma once
// Figs. 9 to 12: the same wall held under each condition, the paper's verdict beside ours.

#include "host_tools/experiment/max_stiffness/held_wall_study.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

report::Section held_wall_section(const SubjectSet& set, const std::vector<HeldWallResult>& results);

}  // namespace kmax::experiment
