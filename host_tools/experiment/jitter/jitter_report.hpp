#pragma once
// Table I as it came out, beside the paper's: tables for the terminal, a page, pictures.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/jitter/jitter_experiment.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// The table with one thing taken out of the model.
struct JitterVariation {
  std::string name;
  std::vector<JitterResult> results;
  JitterVerdict verdict;
};

struct JitterStudy {
  JitterWall wall;
  report::Origin origin = report::Origin::predicted;
  std::vector<JitterResult> results;
  JitterVerdict verdict;
  std::vector<JitterVariation> variations;  ///< empty for a device
  std::string circumstances;                ///< who held what, in one or two sentences
  /// One touch at F_I = 5 N without and with F_B = 3 N, as Fig. 2 shows it; empty for a device.
  std::vector<RigSample> without, with;
};

/// The simulated study: the table, and the table without stiffening and without an answer to F_I.
JitterStudy study_jitter(const JitterSettings& settings, const SimulatedHands& hands,
                         const std::vector<simulation::OperatorModel>& people,
                         const ProgressReport& tell = {});

/// What somebody did on a device, who is told by the rig.
JitterStudy study_jitter(DeviceRig& rig, const JitterSettings& settings);

report::Table jitter_table(const JitterStudy& study);         ///< every pair of forces
report::Table jitter_claims_table(const JitterStudy& study);  ///< the paper's claims, one row each
report::Table jitter_variations_table(const JitterStudy& study);

/// What holds, what does not, and what was not reproduced; whole sentences.
std::vector<std::string> jitter_words(const JitterStudy& study);

/// CSV, pictures and the page, in a folder that is made if need be. `ending`: ".svg" or ".png". Returns the
/// names written. Throws plot::FigureError, std::runtime_error.
std::vector<std::filesystem::path> write_jitter(const JitterStudy& study, const std::filesystem::path& folder,
                                                const std::string& ending);

}  // namespace kmax::experiment
