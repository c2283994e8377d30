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
// Simulated: control::HapticLoop<float>, the firmware's own code, on simulation::CoupledHandle. What the
// person answers to with activation and push is F_B, and inside the wall `reaction` times F_I as well: a
// person who never presses harder than before could not hold the wall against F_I > push, and the bouncing
// would not end. That answer, the stiffness of the wall, the push and the speed are not in the paper: they
// are settings.
//
// The forces exceed the 3.3 N of the paper's own device: the simulated one is not clipped, and the share of
// samples beyond 3.3 N is reported.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "control/haptic_loop.hpp"
#include "host_tools/experiment/background_trend.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

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
  simulation::DeviceModel device{.force_limit = 0.0};
  double count_length = paper::touch_resolution;  ///< m
  double approach_speed = 0.2;                    ///< m/s
  double push = 1.0;                              ///< N, static, without what the person answers to
  double reaction = 1.0;                          ///< 0 to 1, the share of F_I that the person answers to
  double waiting_time = 2.0;  ///< s under F_B before the approach: the arm needs 1.2 to 1.5 s (section 5)
  int touches = 4;            ///< per person, started at different moments within a sample
};

struct JitterSample {
  double time;              ///< s
  double outside_distance;  ///< m, as the encoder shows it; <= 0 inside
  double force;             ///< N
};

struct JitterMeasure {
  bool touched = false;
  bool settled = false;
  double amplitude = 0.0;           ///< m
  double adjustment_time = 0.0;     ///< s; if not settled, to the last moment outside within the window
  double beyond_limit_share = 0.0;  ///< of the samples from the first touch on, beyond the paper's 3.3 N
};

/// Judges a recording in order of time, whatever device it is from. The first touch may be anywhere in it.
JitterMeasure measure_jitter(std::span<const JitterSample> samples, const JitterWall& wall);

/// One touch. `phase` 0 to 1: when within a sample the handle meets the surface. Throws
/// std::invalid_argument.
JitterMeasure simulate_jitter(const JitterSettings& settings, const simulation::OperatorModel& person,
                              double background, double interference, double phase = 0.0,
                              std::vector<JitterSample>* recording = nullptr);

/// The mean over people and touches for one pair of forces.
struct JitterResult {
  paper::JitterCell paper;  ///< the forces and the paper's two numbers
  double amplitude = 0.0, adjustment_time = 0.0, beyond_limit_share = 0.0;
  std::size_t touches = 0, unsettled = 0, without_touch = 0, aborted = 0;
};
JitterResult mean_jitter(const paper::JitterCell& cell, std::span<const JitterMeasure> touches);

/// All pairs of Table I. `tell` is called before each pair with how many are done, and may throw.
std::vector<JitterResult> run_jitter(const JitterSettings& settings,
                                     const std::vector<simulation::OperatorModel>& people,
                                     const ProgressReport& tell = {});

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

}  // namespace kmax::experiment
