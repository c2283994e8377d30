#pragma once
// The largest stable stiffness over the loop's rate, a table for each encoder and measure of instability.

#include "host_tools/experiment/max_stiffness/update_rate_study.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

report::Section rate_section(const std::vector<RateResult>& results);

}  // namespace kmax::experiment
