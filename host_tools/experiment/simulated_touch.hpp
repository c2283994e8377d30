#pragma once
// One touch of a simulated wall: a person approaches, presses, holds and lets go, and the hold is judged as
// contact_measure.hpp judges it. The controller is the firmware's own haptic loop in float
// (control/haptic_loop.hpp), sampled at its rate with its force held in between; the encoder is ideal; the
// handle and the person are those of coupled_handle.hpp. What the firmware does beside the loop (states,
// trips, soft start, motor) has no part in a touch that went well and is not run: `kmax simulate` runs all of
// it and gives the same positions (tests/host_tools/experiment/simulated_touch_test.cpp).
//
// The person answers to resisted_force().
//
// Judged are the true positions at the haptic samples, which is what an encoder without quantum would give.
//
// Cost: one haptic tick and one CoupledHandle::advance() per sample. A touch ends as soon as its verdict is
// certain: unless told otherwise, one that is still in a quarter of the judged window is not simulated to the
// window's end.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "control/haptic_loop.hpp"
#include "host_tools/simulation/contact_measure.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/integrator_config.hpp"

namespace kmax::experiment {

// The haptic loop as the papers' experiments have it at `rate` Hz (SI units): surface at 0 with free space
// above, no soft start, no trip, the force clipped at `force_limit` N (0: not clipped).
control::HapticLoopConfig<float> touched_wall(double rate, double count_length, double force_limit);

// What the hand resists, N: with activation and push along the wall's normal, the field, F_B and inside
// `interference_share` times F_I (paper 1, eq. 2); with activation alone across it, F_I of eq. 4. Of the
// loop's last sample.
struct Resisted {
  double along, across;
};
Resisted resisted_force(const control::HapticLoop<float>& loop,
                        const control::HapticLoop<float>::Coefficients& coefficients,
                        double interference_share = 1.0);

// Bits of the activation that a table of many touches keeps: at most 0.1 % of g, which shifts the largest
// stable stiffness by less than 0.01 N/mm (propagator_table.hpp gives the slope). A table of 12 bits is
// larger than the processor's cache, and takes twice as long.
inline constexpr int study_gain_bits = 9;

// What a law that the firmware does not have adds to the wall's force, N along +x: asked at every sample with
// the encoder's count and what the sample before gave.
using AddedForce = std::function<double(std::int64_t count, const control::HapticLoop<float>::Output& last)>;

struct TouchSetup {
  simulation::DeviceModel device;  // force_limit: the device's own clip; keep it as the loop's
  simulation::OperatorModel person;
  simulation::IntendedMotionConfig motion;
  simulation::IntegratorConfig integrator;
  // For many touches of one person with one device, one after the other: propagator_table.hpp. May be null.
  std::shared_ptr<simulation::PropagatorTable> matrices;
  control::HapticLoopConfig<float> wall = touched_wall(500.0, 0.055e-3, 3.3);
  double window = 1.0;                             // s, the end of the hold that is judged
  double threshold = simulation::unstable_motion;  // m peak to peak
  // N peak to peak. Above 0: judged is the force asked for, by the same rule, instead of the position. A
  // stiff wall on a coarse encoder swings by newtons while the handle moves by less than a count.
  double force_threshold = 0.0;
  // With a force threshold: the position is judged as well, and a touch is unstable by either.
  bool judges_both = false;
  // Of wall.stiffness, mean over the samples inside in the window's last quarter: a wall that grows and comes
  // to less is not held, however still the handle. People distinguish stiffnesses that are 8 to 23 % apart
  // (Jones and Hunter 1990; Tan, Durlach, Beauregard, Srinivasan 1995). 0: it is not asked for.
  double least_rendered_share = 0.95;
  // Makes what is added in one touch, which begins without a memory. None: nothing is.
  std::function<AddedForce(const TouchSetup&)> added_force{};
};

struct TouchSample {
  double time;                  // s
  double position;              // m, true
  double velocity;              // m/s, true
  double hand_position;         // m
  double force;                 // N, asked for
  double background_force;      // N, what the person presses against
  double magnetic_coefficient;  // N
};

struct TouchOutcome {
  simulation::ContactVerdict verdict = simulation::ContactVerdict::no_contact;
  double peak_to_peak = 0.0;            // m (N by the force), over what was simulated of the window
  bool by_force = false;                // the criterion that peak_to_peak and verdict are of
  double deepest = 0.0;                 // m, in it
  double rendered_share = 1.0;          // see TouchSetup; 0 if the handle was not inside then
  bool rendered = true;                 // the share is as large as the setup asks for
  double saturated_share = 0.0;         // of the samples since the first contact: force limited or clipped
  double contact_speed = 0.0;           // m/s, true, towards the wall at the first sample inside
  double coefficient_at_contact = 0.0;  // N, F_MC there
  std::uint64_t samples = 0;            // haptic samples simulated
  std::uint64_t event_limit_hits = 0;   // coupled_handle.hpp; 0 unless a friction event could not be resolved
  bool unstable() const { return verdict == simulation::ContactVerdict::unstable; }
  // Neither does it oscillate, nor has it stayed softer than it was set.
  bool held() const { return !unstable() && rendered; }
};

// `recording`: every sample is appended, and the touch is simulated to the end of its hold. Throws
// std::invalid_argument for models or settings out of range.
TouchOutcome simulate_touch(const TouchSetup& setup, std::vector<TouchSample>* recording = nullptr);

// One criterion: the position, m peak to peak, or the force asked for, N peak to peak.
struct TouchJudgement {
  bool by_force = false;
  double threshold = simulation::unstable_motion;
};

// One touch judged by several criteria, each by itself: to the last bit what simulate_touch() gives with each
// of them alone, in their order, for the cost of the one that is certain last. The setup's own criteria are
// not used. Throws as simulate_touch() does.
std::vector<TouchOutcome> judge_touch(const TouchSetup& setup, std::span<const TouchJudgement> judgements);

}  // namespace kmax::experiment
