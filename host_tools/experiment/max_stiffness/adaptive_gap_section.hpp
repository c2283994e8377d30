#pragma once
// What would make the adaptive wall reach the paper's number: each approach speed alone, and the constant
// coefficient that it would take. The words follow the numbers.

#include "host_tools/experiment/max_stiffness/adaptive_gap.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

report::Section adaptive_gap_section(const SubjectSet& set, const std::vector<ApproachResult>& approaches,
                                     const NeededCoefficient& needed);

}  // namespace kmax::experiment
