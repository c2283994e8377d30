#pragma once
// Paper 2, section 3: a wall of 1.2 N/mm is touched at different speeds, with the position re-sampled to
// steps of 0.1 and of 0.4 mm. Its two claims as read here:
//
//   1. at 0.4 mm the wall vibrates (Figure 2), at every speed
//   2. at 0.1 mm it is still (Figure 1) up to 0.1 m/s, and vibrates above
//
// The paper gives neither the update rate nor the hand nor any delay. 1 kHz is assumed. With a full grip and
// no delay nothing here vibrates, at any of its settings; with a weak grip and half a millisecond of delay
// both claims appear. Those two numbers were chosen so that they do: calibration, not prediction. All four
// combinations are computed, so that each cause is seen alone, and so is the encoder's own step, which is the
// control: what it shows cannot be the work of a coarse position.
//
// Each speed is touched with several pushes and at several moments within a sample; a wall vibrates when any
// touch does. The push matters: a person who happens to press with a force that the coarse wall can make (a
// multiple of K eta) holds still in the middle of a step.
//
// On a device nobody keeps a speed that is asked for: the one of the recording counts. The position that a
// device records is the re-sampled one. A handle that moves across the border between two steps of 0.4 mm
// shows a whole step, more than the threshold, however little it moves: taken as vibration, since the person
// feels the force jump by K eta.
//
// Beside it the paper's criterion, K max(eta, delta v T) <= F_h
// (control/resolution_criterion.hpp), with delta = 1 and F_h = the push.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "control/resampler.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/simulated_rig.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/report/page.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::experiment {

struct ResolutionWall {
  double stiffness = paper::resolution_stiffness;  ///< N/m
  double haptic_rate = 1000.0;                     ///< Hz; not in the paper
  double hold = 3.0;                               ///< s from the touch; the last second is judged
  double threshold = simulation::unstable_motion;  ///< m peak to peak
  control::Rounding rounding = control::Rounding::nearest;
  bool operator==(const ResolutionWall&) const = default;
};

struct ResolutionHand {
  double grip = 1.0;   ///< factor of grip stiffness and grip damping
  double delay = 0.0;  ///< s from a command to its force
  bool operator==(const ResolutionHand&) const = default;
};

struct ResolutionSettings {
  ResolutionWall wall;
  std::vector<double> resolutions{0.0, 0.1e-3, 0.4e-3};                          ///< m; 0: the encoder's own
  std::vector<double> speeds{0.02, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5};  ///< m/s
  std::vector<double> pushes{0.3, 0.6, 1.0};                                     ///< N, of simulated people
  int touches = 4;                                                               ///< for each speed and push
};
/// What is asked of a person on a device unless something else is said.
inline ResolutionSettings resolution_on_device() {
  ResolutionSettings settings;
  settings.speeds = {0.05, 0.08, 0.15, 0.3};
  settings.touches = 1;
  return settings;
}

/// The Desktop's encoder and friction.
inline SimulatedHands resolution_hands() {
  SimulatedHands hands;
  hands.device.friction = 0.06;
  hands.count_length = paper::desktop_resolution;
  return hands;
}
inline constexpr ResolutionHand weak_hand{0.25, 0.5e-3};
/// These people and their device with a hand's grip and delay. Throws std::invalid_argument.
SimulatedRig rig_with(const ResolutionHand& hand, std::vector<simulation::OperatorModel> people,
                      SimulatedHands hands);

struct ResolutionCell {
  double resolution = 0.0;  ///< m, asked for; 0: the encoder's own
  double step = 0.0;        ///< m, in use: whole counts
  double speed = 0.0;       ///< m/s of the approach
  std::size_t touches = 0, unstable = 0, without_contact = 0;
  std::size_t people = 0, people_unstable = 0;  ///< for whom any touch vibrates
  double peak_to_peak = 0.0;                    ///< m, the largest
  double force_step = 0.0;                      ///< N, K max(eta, v T)
  bool vibrates() const { return 2 * people_unstable >= people && people_unstable > 0; }
  bool judged() const { return touches > without_contact; }
};

struct ResolutionRun {
  ResolutionHand hand;
  std::vector<ResolutionCell> cells;
};

/// One touch, as a journal keeps it.
struct ResolutionTouch {
  double speed = 0.0;  ///< m/s, measured on a device
  bool unstable = false, without_contact = false, aborted = false;
  double peak_to_peak = 0.0;  ///< m
  std::uint64_t lost_records = 0;
  bool counts() const { return !without_contact; }
};
void to_json(RunJournal::Json& json, const ResolutionTouch& touch);
void from_json(const RunJournal::Json& json, ResolutionTouch& touch);  ///< throws what is wrong

/// Everything the touches on a device depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const ResolutionSettings& settings);

/// One touch before anybody is asked for it.
TouchPlan resolution_plan(const ResolutionWall& wall, double step, double speed, int number, int touches);
RigWall rig_wall(const ResolutionWall& wall, double resolution);

struct ResolutionTouches {
  /// One for each resolution and speed; on a device one for each touch, with the speed that was measured.
  std::vector<ResolutionCell> cells;
  std::size_t aborted = 0;  ///< of the touches: taken as vibrating
  std::uint64_t lost_records = 0;
};
/// Every resolution at every speed. `progress` and errors as run_jitter().
ResolutionTouches run_resolution(Rig& rig, const ResolutionSettings& settings,
                                 const ProgressReport& progress = {});

/// Of simulated people: full grip without delay, with delay, weak grip without delay, with delay, in this
/// order.
std::vector<ResolutionRun> run_hands(const ResolutionSettings& settings, const ResolutionHand& weak,
                                     const SimulatedHands& hands,
                                     const std::vector<simulation::OperatorModel>& people,
                                     const ProgressReport& progress = {});

struct ResolutionVerdict {
  TestedClaim coarse_vibrates;     ///< 0.4 mm: at every speed
  TestedClaim fine_is_still;       ///< 0.1 mm: at every speed below the onset
  TestedClaim fine_vibrates_fast;  ///< 0.1 mm: at every speed above it
  bool any_vibrates = false;       ///< in any touch of anybody
  /// The encoder's own step, where it was run, is still at some speed where 0.1 mm vibrates: only then is the
  /// onset the work of the resolution.
  std::optional<bool> onset_from_resolution;
  /// Both claims.
  TestedClaim claim_met() const { return all_hold({coarse_vibrates, fine_is_still, fine_vibrates_fast}); }
  bool all_tested() const {
    return coarse_vibrates.has_value() && fine_is_still.has_value() && fine_vibrates_fast.has_value();
  }
};
/// Needs cells of both resolutions on both sides of the onset speed: what has no cell with a contact is not
/// tested.
ResolutionVerdict judge_resolution(std::span<const ResolutionCell> cells);

/// The claims with one number of the weak hand's setting changed.
struct ResolutionVariation {
  std::string change;
  ResolutionVerdict verdict;
  std::optional<double> coarse_onset, fine_onset;  ///< m/s, onset_speed()
};
/// Other grips, delays, friction and roundings: how much the claims hang on the numbers chosen. What the
/// settings have already is left out.
std::vector<ResolutionVariation> vary_resolution(const ResolutionSettings& settings,
                                                 const ResolutionHand& weak, const SimulatedHands& hands,
                                                 const std::vector<simulation::OperatorModel>& people,
                                                 const ProgressReport& progress = {});

/// The lowest speed from which on every higher one vibrates; nothing if the highest does not.
std::optional<double> onset_speed(std::span<const ResolutionCell> cells, double resolution);

// Paper 2's two claims as they came out: maps of what vibrates, tables, a page.

struct ResolutionStudy {
  ResolutionWall wall;
  report::Origin origin = report::Origin::calibrated;
  std::vector<ResolutionRun> runs;              ///< the last one is what the claims are judged by
  std::vector<ResolutionVariation> variations;  ///< empty for a device
  std::vector<double> pushes;                   ///< N; empty for a device
  std::string circumstances;
  /// One touch at 0.4 mm and one at 0.1 mm with the last hand, 0.05 m/s; empty for a device.
  std::vector<double> trace_time, trace_coarse, trace_fine;  ///< s, m, m

  /// The last hand's numbers are those that were chosen so that both claims appear on this wall; else they
  /// are as somebody asked for.
  bool chosen_to_agree() const { return runs.back().hand == weak_hand && wall == ResolutionWall(); }
  ResolutionVerdict verdict() const { return judge_resolution(runs.back().cells); }
};

/// The simulated study: every hand, and the weak one with one number changed.
ResolutionStudy study_resolution(const ResolutionSettings& settings, const ResolutionHand& weak,
                                 const SimulatedHands& hands,
                                 const std::vector<simulation::OperatorModel>& people,
                                 const ProgressReport& progress = {});

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
                                                    const Provenance& provenance,
                                                    const std::filesystem::path& folder,
                                                    const std::string& ending);

}  // namespace kmax::experiment
