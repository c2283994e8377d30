#pragma once
// Table II of paper 1 (section 2.2.2, Fig. 3): a person presses the handle against a wall and is pushed along
// the surface by pulses of F_I, five without a background force and five with F_B along the normal (eq. 4).
// Dev is how far a pulse moves the handle along the surface.
//
// Dev here: the largest distance along the surface from where the handle was when the pulse began, the mean
// of the pulses. The length of the pulses is not in the paper; 0.5 s on, 0.5 s off.
//
// Simulated: the normal axis is a simulation::CoupledHandle against control::HapticLoop<float>, whose own
// interference (mode parallel) gives both forces, F_I switched with the pulses and F_B on at t_0 of the touch
// (the loop's own onset time begins anew at every contact, so a handle that leaves the wall for one sample
// would lose F_B); the tangential axis is a second CoupledHandle of the same person, whose arm is activated
// by the background force of the first one and who intends to stay where the handle is. That the hand is the
// same in both directions is an assumption. The person presses harder than any F_B, so that contact is never
// lost: a bouncing handle would be pushed along the surface for less time, and that would pass for a stiffer
// arm.
//
// With activation_gain = 0 nothing in this model makes Dev depend on F_B: that case is computed beside every
// other, and there the paper's trend must fail.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/experiment/background_trend.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

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
  simulation::DeviceModel device{.force_limit = 0.0};
  double count_length = paper::touch_resolution;  ///< m, both axes
  double approach_speed = 0.2;                    ///< m/s
  double push = 5.0;                              ///< N, static; above every F_B
};

struct DeviationSample {
  double time;        ///< s from the touch
  double tangential;  ///< m along the surface, as the encoder shows it
  double force;       ///< N along the surface
};

struct DeviationMeasure {
  double without = 0.0, with = 0.0;  ///< m, mean of the pulses in each half
  std::size_t pulses = 0;            ///< that had samples; 2 x protocol.pulses if all did
};

/// `begins`: when each pulse began, s from the touch, the first half without F_B, the second with it.
DeviationMeasure measure_deviation(std::span<const DeviationSample> samples, std::span<const double> begins,
                                   double pulse_on);

struct DeviationTouch {
  DeviationMeasure measure;
  bool touched = false;
  double contact_share = 0.0;       ///< of the samples from the touch on
  double beyond_limit_share = 0.0;  ///< of them, with a force on either axis beyond the paper's 3.3 N
};

/// One touch. Throws std::invalid_argument.
DeviationTouch simulate_deviation(const DeviationSettings& settings, const simulation::OperatorModel& person,
                                  double background, double interference,
                                  std::vector<DeviationSample>* recording = nullptr);

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

/// All pairs of Table II; `tell` as run_jitter().
std::vector<DeviationResult> run_deviation(const DeviationSettings& settings,
                                           const std::vector<simulation::OperatorModel>& people,
                                           const ProgressReport& tell = {});

struct DeviationVerdict {
  std::vector<BackgroundTrend> trends;  ///< m, one for each F_I that has a deviation in the paper
  std::optional<double> rank;           ///< ours against the paper's, over all pairs
  /// The paper's claim (section 2.2.2): the deviation decreases while F_B increases.
  TestedClaim claim_met() const;
};
DeviationVerdict judge_deviation(std::span<const DeviationResult> results);

/// As DeviationVerdict::trends, of Table II as it is printed, whatever was touched here.
std::vector<BackgroundTrend> printed_deviation_trends();

}  // namespace kmax::experiment
