#pragma once
// Table I of paper 1 (section 2.2.1): a person touches a wall whose inside adds an interference force F_I
// along the normal, while a background force F_B acts everywhere (eq. 2). The handle is thrown out and
// pressed back until the person has adjusted.
//
// The paper defines neither of its two numbers; ours, from what an encoder shows:
//   Jit   the largest distance outside the surface after the first touch
//   AT    from the first touch to the last moment outside; only if the handle then stays inside (`settled`)
// Both are 0 when the first touch already holds, as in the paper at F_I = 1 N.
//
// A simulated person answers to F_B, and inside the wall `reaction` times to F_I as well (simulated_rig.hpp):
// one who never presses harder than before could not hold the wall against F_I > push, and the bouncing would
// not end. That answer, the stiffness of the wall, the push and the speed are not in the paper: they are
// settings. On a device the person is asked, for each pair of forces, to touch the wall and to keep the
// handle there.
//
// The forces exceed the 3.3 N of the paper's own device: the simulated one is not clipped, and the share of
// samples beyond 3.3 N is reported.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/simulated_rig.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// What both kinds of device are set to.
struct JitterWall {
  double stiffness = 1000.0;   ///< N/m; paper 1 does not give it
  double haptic_rate = 500.0;  ///< Hz, section 4.2
  double window = 3.0;         ///< s from the first touch
  double settled_time = 0.25;  ///< s at the window's end that must be inside
};

struct JitterSettings {
  JitterWall wall;
  int touches = 4;  ///< per person and pair of forces; simulated: begun at different moments within a sample
  std::vector<paper::JitterCell> pairs{paper::table_1.begin(), paper::table_1.end()};
};

/// What holds the handle unless something else is said: the arm needs 1.2 to 1.5 s under F_B (section 5).
inline SimulatedHands jitter_hands() {
  SimulatedHands hands;
  hands.waiting_time = 2.0;
  return hands;
}
/// The paper's jitter reaches 10 mm.
inline TouchLimits jitter_limits() {
  TouchLimits limits;
  limits.abort_amplitude = 0.03;
  return limits;
}

struct JitterMeasure {
  bool touched = false;
  bool settled = false;
  double amplitude = 0.0;           ///< m
  double adjustment_time = 0.0;     ///< s; if not settled, to the last moment outside within the window
  double beyond_limit_share = 0.0;  ///< of the samples from the first touch on, beyond the paper's 3.3 N
};

/// Judges a recording in order of time, whatever device it is from. The first touch may be anywhere in it.
JitterMeasure measure_jitter(std::span<const RigSample> samples, const JitterWall& wall);

/// One touch, as a journal keeps it.
struct JitterTouch {
  JitterMeasure measure;  ///< nothing if aborted
  bool aborted = false;
  double limited_share = 0.0;
  std::uint64_t lost_records = 0;
  /// A jitter that fell into a gap of the trace was never seen.
  bool counts() const { return aborted || (measure.touched && lost_records == 0); }
};
void to_json(RunJournal::Json& json, const JitterTouch& touch);
void from_json(const RunJournal::Json& json, JitterTouch& touch);  ///< throws what is wrong

/// Everything the touches on a device depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const JitterSettings& settings);

/// The mean over people and touches for one pair of forces.
struct JitterResult {
  paper::JitterCell paper;  ///< the forces and the paper's two numbers
  double amplitude = 0.0, adjustment_time = 0.0, beyond_limit_share = 0.0;
  std::size_t touches = 0, unsettled = 0, without_touch = 0, aborted = 0;
};
JitterResult mean_jitter(const paper::JitterCell& cell, std::span<const JitterMeasure> touches);

struct JitterRun {
  std::vector<JitterResult> results;
  double limited_share = 0.0;      ///< on a device: the greatest share of limited samples in a touch
  std::uint64_t lost_records = 0;  ///< of touches that were aborted, or not counted for it
};

/// All pairs of forces. An aborted touch is counted, not averaged. One that lost records of its trace every
/// time it was made is neither; the rig notes it. `progress` is called before each pair with how many are
/// done, and may throw. Throws std::invalid_argument for settings out of range, and what the rig throws.
JitterRun run_jitter(Rig& rig, const JitterSettings& settings, const ProgressReport& progress = {});

struct JitterVerdict {
  std::vector<BackgroundTrend> amplitude, time;     ///< one for each F_I that has jitter in the paper
  std::optional<double> amplitude_rank, time_rank;  ///< ours against the paper's, over all pairs
  bool all_settled = true;
  TestedClaim amplitude_falls() const;
  TestedClaim time_falls() const;  ///< not tested while a touch has not settled: it has no adjustment time
  /// The paper's claim (section 2.2.1): both decrease when F_B increases.
  TestedClaim claim_met() const { return all_hold({amplitude_falls(), time_falls()}); }
};
JitterVerdict judge_jitter(std::span<const JitterResult> results);

// Table I as it came out, beside the paper's: tables for the terminal, a page, pictures.

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
                         const ProgressReport& progress = {});

/// What somebody did on a device, who is told by the rig.
JitterStudy study_jitter(DeviceRig& rig, const JitterSettings& settings);

report::Table jitter_table(const JitterStudy& study);         ///< every pair of forces
report::Table jitter_claims_table(const JitterStudy& study);  ///< the paper's claims, one row each
report::Table jitter_variations_table(const JitterStudy& study);

/// What holds, what does not, and what was not reproduced; whole sentences.
std::vector<std::string> jitter_words(const JitterStudy& study);

/// CSV, pictures and the page, in a folder that is made if need be. `ending`: ".svg" or ".png". Returns the
/// names written. Throws plot::FigureError, std::runtime_error.
std::vector<std::filesystem::path> write_jitter(const JitterStudy& study, const Provenance& provenance,
                                                const std::filesystem::path& folder,
                                                const std::string& ending);

}  // namespace kmax::experiment
