#pragma once
// Pictures of the studies of the largest stiffness. Each returns what a page shows; the file's folder must
// exist. Throw plot::FigureError.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "host_tools/experiment/max_stiffness/update_rate_study.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

// The picture before it is drawn, with all of it in sight.
plot::Figure max_stiffness_figure(const std::vector<MaxStiffnessStudy>& studies);
// What is said under it: which of the values are calibrated.
std::string max_stiffness_caption(const std::vector<MaxStiffnessStudy>& studies);

// The mean over F_MC, with what the paper prints, and every adaptive mode as a level.
report::Picture draw_max_stiffness(const std::vector<MaxStiffnessStudy>& studies,
                                   const std::filesystem::path& file);

// Stiffness over the rate of the loop, for one encoder and one measure.
report::Picture draw_rates(const std::vector<RateResult>& results, double count_length, RateMeasure measure,
                           const std::filesystem::path& file);

}  // namespace kmax::experiment
