#pragma once
// Table II as it came out, beside the paper's, and what the table can tell of the hand.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/deviation/deviation_experiment.hpp"
#include "host_tools/experiment/deviation/deviation_fit.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct DeviationStudy {
  report::Origin origin = report::Origin::predicted;
  std::vector<DeviationResult> results;
  DeviationVerdict verdict;
  /// Likewise for a hand that does not stiffen; empty for a device.
  std::vector<DeviationResult> without_stiffening;
  DeviationVerdict verdict_without_stiffening;
  std::vector<DeviationFit> fits;  ///< of the paper's table
  std::string circumstances;
  std::vector<RigSample> touch;  ///< F_I = 5 N, F_B = 3 N, as Fig. 3 shows it; empty for a device
};

/// The simulated study. Throws std::invalid_argument for a push that loses the wall against an F_B.
DeviationStudy study_deviation(const DeviationSettings& settings, const SimulatedHands& hands,
                               const std::vector<simulation::OperatorModel>& people,
                               const ProgressReport& tell = {});

/// What somebody did on a device, who is told by the rig; it notes what was not counted.
DeviationStudy study_deviation(DeviceRig& rig, const DeviationSettings& settings);

report::Table deviation_table(const DeviationStudy& study);
report::Table deviation_claims_table(const DeviationStudy& study);
report::Table deviation_fit_table(const DeviationStudy& study);

/// What holds, what does not, and what the table does not tell; whole sentences.
std::vector<std::string> deviation_words(const DeviationStudy& study);

/// As write_jitter().
std::vector<std::filesystem::path> write_deviation(const DeviationStudy& study,
                                                   const std::filesystem::path& folder,
                                                   const std::string& ending);

}  // namespace kmax::experiment
