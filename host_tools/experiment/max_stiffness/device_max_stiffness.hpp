#pragma once
// The largest stable stiffness of each wall of paper 1 (Figs. 6 and 8) on a device, with a person's hand on
// its handle, or with a simulated hand on a device that is served.
//
// Each stiffness of a StiffnessClimb is touched `trials` times; one unstable touch decides (the paper's
// definition). Every touch is watched_touch.hpp's: limited, watched, disarmed at once when the handle
// oscillates too much, which counts as unstable. Each touch that is over is in the journal at once: a run
// that was interrupted goes on with the next one.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct DeviceStiffnessSettings {
  ContactSettings touch;  ///< its stiffness has no meaning here
  StiffnessSteps steps{.first = paper::search_start,
                       .step = paper::stiffness_step,
                       .last = 20e3,
                       .first_adaptive = paper::search_start_adaptive,
                       .goes_down = true};
  std::size_t trials = 1;  ///< touches at each stiffness
};

struct DeviceStiffnessTouch {
  double stiffness = 0;   ///< N/m
  std::size_t trial = 0;  ///< from 1
  simulation::ContactVerdict verdict = simulation::ContactVerdict::no_contact;
  double peak_to_peak = 0;  ///< m
  double limited_share = 0;
  bool aborted = false;
  std::uint64_t lost_records = 0;  ///< of the trace
  bool counts() const { return verdict != simulation::ContactVerdict::no_contact; }
};

/// In a journal; without stiffness and trial, which are in the key. from_json throws what is wrong.
void to_json(RunJournal::Json& json, const DeviceStiffnessTouch& touch);
void from_json(const RunJournal::Json& json, DeviceStiffnessTouch& touch);

struct DeviceStiffnessResult {
  StiffnessCondition condition;
  MaxStiffness found;  ///< without what only a simulated touch knows: speeds, pushes, simulated time
  std::vector<DeviceStiffnessTouch> touches;
};

/// Everything the touches depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const DeviceStiffnessSettings& settings);

/// One condition. A touch that leaves the wall too early or that cannot be judged is made again
/// (touch_journal.hpp); then the search ends there (never_touched). Errors: those of the rig and of its
/// journal; NobodyTouched after the third time.
DeviceStiffnessResult find_max_stiffness(Rig& rig, const StiffnessCondition& condition,
                                         const DeviceStiffnessSettings& settings);

/// What paper 1 claims and this can contradict: a field of 2 N and every adaptive wall allow more stiffness
/// than the plain wall. Conditions that have not been measured say nothing, nor do those whose search ended
/// before an unstable touch (beyond_last, never_touched).
bool order_is_the_papers(const std::vector<DeviceStiffnessResult>& results);

/// A row for each condition: K_max beside the paper's, each with where it comes from.
report::Table device_stiffness_table(const std::vector<DeviceStiffnessResult>& results);

/// A row for each touch.
report::Table device_touch_table(const std::vector<DeviceStiffnessResult>& results);

/// What was done, in sentences.
std::vector<std::string> device_stiffness_words(const DeviceStiffnessSettings& settings,
                                                const TouchLimits& limits, const std::string& device);

/// max_stiffness.md, .html, both tables as .csv, and a picture of every touch's oscillation over its
/// stiffness, if there are touches. Returns the names written. Throws plot::FigureError, std::runtime_error.
std::vector<std::filesystem::path> write_device_stiffness(
    const std::vector<DeviceStiffnessResult>& results, const DeviceStiffnessSettings& settings,
    const TouchLimits& limits, const std::string& device, const Provenance& provenance,
    const std::filesystem::path& folder, const std::string& picture_ending);

}  // namespace kmax::experiment
