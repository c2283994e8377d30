#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/device/trace_reader.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/restored_afterwards.hpp"
#include "host_tools/experiment/watched_touch.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::experiment {

/// One of the walls that paper 1 lets its subject 1 touch (section 4.4, Figs. 9 to 12).
struct ContactCondition {
  std::string name;
  std::string figure;                    ///< of paper 1
  std::vector<std::string> assignments;  ///< NAME=VALUE, what sets it apart
  std::string paper_words;               ///< what the paper says of it
  bool paper_stable = false;
};

/// F_MC = 0, 1, 2 N and the adaptive wall in each way its coefficient can follow the velocity; the paper
/// does not say which way it used.
std::vector<ContactCondition> contact_conditions();

struct ContactSettings {
  std::size_t axis = 0;
  double stiffness = paper::contact_stiffness;    ///< N/m
  double haptic_rate = paper::update_rate;        ///< Hz
  double hold_time = 3.0;                         ///< s from the first touch; the last second is judged
  double contact_patience = 10.0;                 ///< s from arming to the first touch
  double threshold = 0.165e-3;                    ///< m peak to peak, contact_measure.hpp
  double force_limit = paper::touch_force_limit;  ///< N; force.limit is lowered to it
  double abort_amplitude = 5e-3;                  ///< m, watched_touch.hpp
};

struct ContactResult {
  ContactCondition condition;
  std::vector<device::TraceSample> samples;  ///< from arming on; time 0 is the first touch
  simulation::ContactMeasure measure;
  double surface = 0, side = 1;           ///< m; wall.position and wall.side
  double judged_from = 0, judged_to = 0;  ///< s
  double limited_share = 0;               ///< of the haptic samples
  std::string velocity_estimator;         ///< what the adaptive laws' velocity came from
  std::uint64_t lost_records = 0;
  std::optional<double> aborted_at;  ///< s from the first touch, watched_touch.hpp
  double outside_distance(const device::TraceSample& sample) const {
    return side * (sample.position - surface);
  }
  std::size_t trials = 1, unstable_trials = 0;  ///< of the condition; the rest is the worst trial's
  /// Held until it was judged; else to be made again.
  bool counts() const { return measure.verdict != simulation::ContactVerdict::no_contact; }
  bool agrees_with_paper() const {
    return (measure.verdict == simulation::ContactVerdict::stable) == condition.paper_stable &&
           measure.verdict != simulation::ContactVerdict::no_contact;
  }
};

/// What all conditions have in common, as assignments.
std::vector<std::string> contact_setup(const ContactSettings& settings);

/// Everything that run_contact() may change, for RestoredAfterwards.
std::vector<std::string> contact_changes(const ContactSettings& settings);

/// The trial with the largest oscillation, which decides: a wall is stable when no touch makes it unstable
/// (paper 1's definition of the maximum stiffness, section 4.2). `trials` must not be empty.
ContactResult worst_of(std::vector<ContactResult> trials);

/// One trial: sets a condition up, arms, records until the hold is over, disarms. Whoever holds the handle
/// presses it against the wall when the axis is armed and keeps pressing for hold_time: a simulated person
/// does so by itself, a real one has to be told. `tell`: progress, called about five times a second with a
/// short text.
///
/// The axis is disarmed however this ends. Errors: those of watch_touch(), device::ValueError.
ContactResult run_contact(device::Device& device, const ContactCondition& condition,
                          const ContactSettings& settings, const Tell& tell);

}  // namespace kmax::experiment
