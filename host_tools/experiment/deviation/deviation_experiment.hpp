#pragma once
// Table II of paper 1 (section 2.2.2, Fig. 3): a person presses the handle against a wall and is pushed along
// the surface by pulses of F_I, five without a background force and five with F_B along the normal (eq. 4).
// Dev is how far a pulse moves the handle along the surface.
//
// Dev here: the largest distance along the surface from where the handle was when the pulse began, the mean
// of the pulses. The length of the pulses is not in the paper; 0.5 s on, 0.5 s off.
//
// Two axes: the wall's is the normal, the other one lies along the surface and takes the interference, which
// the firmware passes from axis to axis; simulated_rig.hpp says how both are simulated. F_I is switched with
// the pulses and F_B on at t_0 of the touch (the loop's own onset time begins again at every contact, so a
// handle that leaves the wall for one sample would lose F_B). The person presses harder than any F_B, so that
// contact is never lost: a bouncing handle would be pushed along the surface for less time, and that would
// pass for a stiffer arm.
//
// On a device pulses are switched by the host, at the link's pace; when each was really switched is what its
// deviation is measured from. A person simulated on one must push harder than F_B, since what the person adds
// against F_B lags behind the onset, and hold for the whole touch: whoever lets go sooner swings out of the
// wall, which ends the touch. The supplied scene paper1_deviation holds for 15 s.
//
// With activation_gain = 0 nothing in this model makes Dev depend on F_B: that case is computed beside every
// other, and there the paper's trend must fail.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/experiment/deviation/deviation_fit.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/simulated_rig.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// What both kinds of device are set to, and the course of a touch: rest, pulses without F_B, onset of F_B,
/// rest, pulses with F_B.
struct DeviationProtocol {
  double stiffness = 1000.0;   ///< N/m; paper 1 does not give it
  double haptic_rate = 500.0;  ///< Hz
  double rest = 1.5;           ///< s after the touch and after the onset: the arm adjusts in 1.2 to 1.5 s
  double pulse_on = 0.5, pulse_off = 0.5;  ///< s
  int pulses = paper::pulses;

  double half() const { return rest + pulses * (pulse_on + pulse_off); }
  double onset() const { return half(); }           ///< s after the touch: t_0 of eq. 4
  double duration() const { return 2.0 * half(); }  ///< s
  /// s after the touch; `number` counts on from 0 to 2 pulses - 1.
  double pulse_begin(int number) const {
    const int second = number >= pulses ? 1 : 0;
    return second * half() + rest + (number - second * pulses) * (pulse_on + pulse_off);
  }
};

struct DeviationSettings {
  DeviationProtocol protocol;
  std::vector<paper::DeviationCell> pairs{paper::table_2.begin(), paper::table_2.end()};
};

/// What holds the handle unless something else is said.
inline SimulatedHands deviation_hands() {
  SimulatedHands hands;
  hands.push = 5.0;  // above every F_B
  return hands;
}
/// Along the surface; the paper's deviation reaches 17 mm. Against the wall, a plain one that is unstable
/// shows more than wall_abort_amplitude.
inline TouchLimits deviation_limits() {
  TouchLimits limits;
  limits.abort_amplitude = 0.05;
  return limits;
}

struct DeviationMeasure {
  double without = 0.0, with = 0.0;  ///< m, mean of the pulses in each half
  std::size_t pulses = 0;            ///< that had samples; 2 x protocol.pulses if all did
};

/// `begins`: when each pulse began, s from the touch, the first half without F_B, the second with it.
DeviationMeasure measure_deviation(std::span<const RigSample> samples, std::span<const double> begins,
                                   double pulse_on);

/// A touch on a device with less contact is not averaged: without the wall there is no F_I.
inline constexpr double least_contact = 0.95;

/// One touch, as a journal keeps it.
struct DeviationTouch {
  DeviationMeasure measure;
  double contact_share = 0.0;  ///< of the samples from the touch on
  double beyond_limit_share =
      0.0;                     ///< simulated: of them, with a force on either axis beyond the paper's 3.3 N
  double limited_share = 0.0;  ///< on a device
  bool touched = true, aborted = false;
  std::uint64_t lost_records = 0;
  bool counts() const { return aborted || contact_share >= least_contact; }
};
void to_json(RunJournal::Json& json, const DeviationTouch& touch);
void from_json(const RunJournal::Json& json, DeviationTouch& touch);  ///< throws what is wrong

/// Everything the touches on a device depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const DeviationSettings& settings);

/// The touch of one pair of forces.
TouchPlan deviation_plan(const DeviationProtocol& protocol, const paper::DeviationCell& pair);

/// The mean over people for one pair of forces.
struct DeviationResult {
  paper::DeviationCell paper;  ///< the forces and the paper's number
  double deviation = 0.0;      ///< m, with F_B
  double before = 0.0;         ///< m, in the same touches before F_B began
  double contact_share = 0.0, beyond_limit_share = 0.0;
  std::size_t touches = 0, aborted = 0;
  std::size_t without_contact = 0;  ///< on a device: left the wall too often to be averaged
};
DeviationResult mean_deviation(const paper::DeviationCell& cell, std::span<const DeviationTouch> touches);

struct DeviationRun {
  std::vector<DeviationResult> results;
  double limited_share = 0.0;  ///< on a device: the greatest
  std::uint64_t lost_records = 0;
};

/// All pairs of forces; a touch that was aborted is counted, not averaged. `progress` and errors as
/// run_jitter().
DeviationRun run_deviation(Rig& rig, const DeviationSettings& settings, const ProgressReport& progress = {});

struct DeviationVerdict {
  std::vector<BackgroundTrend> trends;  ///< m, one for each F_I that has a deviation in the paper
  std::optional<double> rank;           ///< ours against the paper's, over all pairs
  /// The paper's claim (section 2.2.2): the deviation decreases while F_B increases.
  TestedClaim claim_met() const;
};
DeviationVerdict judge_deviation(std::span<const DeviationResult> results);

/// As DeviationVerdict::trends, of Table II as it is printed, whatever was touched here.
std::vector<BackgroundTrend> printed_deviation_trends();

// Table II as it came out, beside the paper's, and what the table can tell of the hand.

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
                               const ProgressReport& progress = {});

/// What somebody did on a device, who is told by the rig; it notes what was not counted.
DeviationStudy study_deviation(DeviceRig& rig, const DeviationSettings& settings);

report::Table deviation_table(const DeviationStudy& study);
report::Table deviation_claims_table(const DeviationStudy& study);
report::Table deviation_fit_table(const DeviationStudy& study);

/// What holds, what does not, and what the table does not tell; whole sentences.
std::vector<std::string> deviation_words(const DeviationStudy& study);

/// As write_jitter().
std::vector<std::filesystem::path> write_deviation(const DeviationStudy& study, const Provenance& provenance,
                                                   const std::filesystem::path& folder,
                                                   const std::string& ending);

}  // namespace kmax::experiment
