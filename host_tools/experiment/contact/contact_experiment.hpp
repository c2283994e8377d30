#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/experiment/touch_changes.hpp"
#include "host_tools/report/page.hpp"
#include "host_tools/simulation/contact_measure.hpp"

namespace kmax::experiment {

/// One of the walls that paper 1 lets its subject 1 touch (section 4.4, Figs. 9 to 12).
struct ContactCondition {
  std::string name;
  std::string figure;                    ///< of paper 1
  std::vector<std::string> assignments;  ///< NAME=VALUE, what sets it apart
  std::string paper_words;               ///< what the paper says of it
  bool paper_stable = false;
  RigWall wall;  ///< its law
};

/// F_MC = 0, 1, 2 N and the adaptive wall in each way its coefficient can follow the velocity; the paper
/// does not say which way it used.
std::vector<ContactCondition> contact_conditions();

struct ContactSettings {
  double stiffness = paper::contact_stiffness;     ///< N/m
  double haptic_rate = paper::update_rate;         ///< Hz
  double hold_time = 3.0;                          ///< s from the first touch; the last second is judged
  double threshold = simulation::unstable_motion;  ///< m peak to peak
  TouchChanges changes{};                          ///< of every touch but haptic.rate, which is above

  /// The wall that the paper's verdicts are of: its stiffness at its rate, and nothing changed.
  bool papers_wall() const {
    return stiffness == paper::contact_stiffness && haptic_rate == paper::update_rate && changes.empty();
  }
  /// That of a condition.
  RigWall wall_of(RigWall law) const {
    law.haptic_rate = haptic_rate;
    law.changes = changes.assignments();
    return law;
  }
};

/// 5 mm of oscillation end a touch, which must begin within 10 s.
TouchLimits contact_limits();

struct ContactResult {
  ContactCondition condition;
  std::vector<RigSample> samples;  ///< from arming on; time 0 is the first touch
  simulation::ContactMeasure measure;
  double surface = 0, side = 1;           ///< m; wall.position and wall.side
  double judged_from = 0, judged_to = 0;  ///< s
  double contact_speed = 0;               ///< m/s towards the wall at the touch, as the encoder shows it
  double limited_share = 0;               ///< of the haptic samples
  std::uint64_t lost_records = 0;
  std::optional<double> aborted_at;  ///< s from the first touch, watched_touch.hpp
  /// m, as the encoder shows it.
  double position(const RigSample& sample) const { return surface + side * sample.outside_distance; }
  std::size_t trials = 1, unstable_trials = 0;  ///< of the condition; the rest is the worst trial's
  /// Held until it was judged; else to be made again.
  bool counts() const { return measure.verdict != simulation::ContactVerdict::no_contact; }
  bool papers_wall = true;  ///< ContactSettings::papers_wall()
  /// On the simulated person: the wall lies between the means that its numbers were fitted to.
  bool implied_by_the_fit() const {
    return papers_wall && condition.wall.law == control::WallKind::magnetic &&
           paper::fitted_to(condition.wall.magnetic_coefficient);
  }
  /// Not tested on another wall than the paper's.
  TestedClaim agrees_with_paper() const {
    if (!papers_wall) return std::nullopt;
    return (measure.verdict == simulation::ContactVerdict::stable) == condition.paper_stable &&
           measure.verdict != simulation::ContactVerdict::no_contact;
  }
};

/// The trial with the largest oscillation, which decides: a wall is stable when no touch makes it unstable
/// (paper 1's definition of the maximum stiffness, section 4.2). `trials` must not be empty.
ContactResult worst_of(std::vector<ContactResult> trials);

/// What a person is asked before a touch that is held for `hold_time` s.
std::string press_request(const std::string& name, double hold_time);

/// One trial: sets a condition up, asks for the touch and judges its hold. Whoever holds the handle presses
/// it against the wall when the axis is armed and keeps pressing for hold_time. Errors: those of the rig.
ContactResult run_contact(Rig& rig, const ContactCondition& condition, const ContactSettings& settings);

/// The experiment: worst_of() `trials` touches under each of contact_conditions(). `touches` hears before
/// each touch how many have been made of how many; `found`, which may be empty, each condition's result as
/// soon as it is there. Errors: those of the rig, and what the two throw.
std::vector<ContactResult> run_contacts(Rig& rig, const ContactSettings& settings, std::size_t trials,
                                        const std::function<void(std::size_t made, std::size_t all)>& touches,
                                        const std::function<void(const ContactResult&)>& found = {});

// What is said of the results.

/// The results beside the paper's words.
report::Table contact_table(const std::vector<ContactResult>& results);

/// A picture (position, force and F_MC over time) and a CSV file with the same base name for one condition.
/// Returns the names written. Throws plot::FigureError or std::runtime_error.
std::vector<std::filesystem::path> write_contact(const ContactResult& result,
                                                 const std::filesystem::path& folder,
                                                 const std::string& picture_ending);

/// "a wall of 5.5 N/mm at 500 Hz".
std::string papers_wall_words();

/// What was done, in sentences. `intended`: of a simulated person.
std::vector<std::string> contact_words(const ContactSettings& settings, std::size_t trials,
                                       const std::string& velocity_estimator,
                                       const std::optional<simulation::IntendedMotionConfig>& intended = {});

/// contact.md and contact.html in the folder of the pictures, which must be as write_contact() left them:
/// one for each result. `words`: contact_words(). `origin`: of the results, which a device measures and a
/// simulation predicts. Returns the names written. Throws std::runtime_error.
std::vector<std::filesystem::path> write_contact_page(const std::vector<ContactResult>& results,
                                                      const std::vector<std::string>& words,
                                                      const std::vector<std::filesystem::path>& pictures,
                                                      const std::filesystem::path& folder,
                                                      report::Origin origin, const Provenance& provenance);

std::string_view to_string(simulation::ContactVerdict verdict);

}  // namespace kmax::experiment
