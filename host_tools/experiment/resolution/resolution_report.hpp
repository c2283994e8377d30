#pragma once
// Paper 2's two claims as they came out: maps of what vibrates, tables, a page.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/resolution/resolution_experiment.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct ResolutionStudy {
  ResolutionWall wall;
  report::Origin origin = report::Origin::calibrated;
  std::vector<ResolutionRun> runs;              ///< the last one is what the claims are judged by
  std::vector<ResolutionVariation> variations;  ///< empty for a device
  std::vector<double> pushes;                   ///< N; empty for a device
  std::string circumstances;
  /// One touch at 0.4 mm and one at 0.1 mm with the last hand, 0.05 m/s; empty for a device.
  std::vector<double> trace_time, trace_coarse, trace_fine;  ///< s, m, m

  ResolutionVerdict verdict() const { return judge_resolution(runs.back().cells); }
};

/// The simulated study: every hand, and the weak one with one number changed.
ResolutionStudy study_resolution(const ResolutionSettings& settings, const ResolutionHand& weak,
                                 const SimulatedHands& hands,
                                 const std::vector<simulation::OperatorModel>& people,
                                 const ProgressReport& tell = {});

/// What somebody did on a device, who is told by the rig.
ResolutionStudy study_resolution(DeviceRig& rig, const ResolutionSettings& settings);

std::string to_string(const ResolutionHand& hand);

/// One row per resolution and speed, a column for each hand.
report::Table resolution_table(const ResolutionStudy& study);
/// The paper's claims for each hand.
report::Table resolution_claims_table(const ResolutionStudy& study);
/// What becomes of them when one number is another.
report::Table resolution_variations_table(const ResolutionStudy& study);
std::vector<std::string> resolution_words(const ResolutionStudy& study);

/// As write_jitter().
std::vector<std::filesystem::path> write_resolution(const ResolutionStudy& study,
                                                    const std::filesystem::path& folder,
                                                    const std::string& ending);

}  // namespace kmax::experiment
