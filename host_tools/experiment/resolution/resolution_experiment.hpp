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
// Simulated with simulated_touch.hpp. Beside it the paper's criterion, K max(eta, delta v T) <= F_h
// (control/resolution_criterion.hpp), with delta = 1 and F_h = the push.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "control/resampler.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::experiment {

struct ResolutionWall {
  double stiffness = paper::resolution_stiffness;  ///< N/m
  double haptic_rate = 1000.0;                     ///< Hz; not in the paper
  double hold = 3.0;                               ///< s from the touch; the last second is judged
  double threshold = 0.165e-3;                     ///< m peak to peak, contact_measure.hpp
  control::Rounding rounding = control::Rounding::nearest;
};

struct ResolutionHand {
  double grip = 1.0;   ///< factor of grip stiffness and grip damping
  double delay = 0.0;  ///< s from a command to its force
};

struct ResolutionSettings {
  ResolutionWall wall;
  std::vector<double> resolutions{0.0, 0.1e-3, 0.4e-3};                          ///< m; 0: the encoder's own
  std::vector<double> speeds{0.02, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5};  ///< m/s
  std::vector<double> pushes{0.3, 0.6, 1.0};                                     ///< N
  int touches = 4;                                                               ///< for each push
  simulation::DeviceModel device{.friction = 0.06, .force_limit = 0.0};          ///< the Desktop's friction
  double count_length = paper::desktop_resolution;                               ///< m
  ResolutionHand weak{0.25, 0.5e-3};
};

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

/// A touch as the experiment makes it; how fast, how hard and from where are the caller's (setup.motion).
TouchSetup resolution_touch(const ResolutionSettings& settings, const ResolutionHand& hand,
                            const simulation::OperatorModel& person, double resolution);

/// Throws std::invalid_argument.
ResolutionCell simulate_resolution(const ResolutionSettings& settings, const ResolutionHand& hand,
                                   const std::vector<simulation::OperatorModel>& people, double resolution,
                                   double speed);

/// Full grip without delay, with delay, weak grip without delay, with delay: in this order.
std::vector<ResolutionRun> run_resolution(const ResolutionSettings& settings,
                                          const std::vector<simulation::OperatorModel>& people,
                                          const ProgressReport& tell = {});

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
                                                 const std::vector<simulation::OperatorModel>& people,
                                                 const ProgressReport& tell = {});

/// The lowest speed from which on every higher one vibrates; nothing if the highest does not.
std::optional<double> onset_speed(std::span<const ResolutionCell> cells, double resolution);

/// m: the resampler's step for a resolution.
double step_in_use(double resolution, double count_length);

}  // namespace kmax::experiment
