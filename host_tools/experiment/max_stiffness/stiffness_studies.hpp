#pragma once
// The studies around the largest stiffness, by their names: what the numbers of max_stiffness_study.hpp come
// from and how far they can be trusted.

#include <array>
#include <filesystem>
#include <string_view>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct StudyName {
  std::string_view name;
  std::string_view what;
};
inline constexpr std::array<StudyName, 6> stiffness_studies{{
    {"figures", "a wall of 5.5 N/mm held under each law (Figs. 9 to 12), predicted"},
    {"causes", "the four causes of the gain at 2 N, one by one"},
    {"assumptions", "threshold, pushes, approach speeds, device, integrator: what hangs on them"},
    {"draws", "25 other groups of people, each calibrated anew"},
    {"adaptive", "what would make the adaptive wall reach the paper's 8.02 N/mm"},
    {"rates", "500 Hz to 20 kHz, two encoders, delays and velocity estimators"},
}};

inline constexpr std::size_t drawn_groups = 25;

// `sets`: calibrated, at least one; "draws" uses the first, since every group takes a calibration; "rates"
// the device of the first and the person of the supplied scenes. The run's journal keeps what is done. Throws
// std::invalid_argument for an unknown name, and what the run throws.
std::vector<report::Section> run_stiffness_study(std::string_view name, const std::vector<SubjectSet>& sets,
                                                 const StiffnessRun& run,
                                                 const std::filesystem::path& folder = {});

}  // namespace kmax::experiment
