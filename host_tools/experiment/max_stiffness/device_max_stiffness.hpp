#pragma once
// The largest stable stiffness of each wall of paper 1 (Figs. 6 and 8) on a device, with a person's hand on
// its handle, or with a simulated hand on a device that is served.
//
// Each stiffness of a StiffnessClimb is touched `trials` times; one unstable touch decides (the paper's
// definition). Every touch is watched_touch.hpp's: limited, watched, disarmed at once when the handle
// oscillates too much, which counts as unstable. Each touch that is over is in the journal at once: a run
// that was interrupted goes on with the next one.

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct DeviceStiffnessSettings {
  ContactSettings touch;                                 ///< its stiffness has no meaning here
  double start = paper::search_start;                    ///< N/m, of a constant coefficient
  double start_adaptive = paper::search_start_adaptive;  ///< N/m
  double step = paper::stiffness_step;                   ///< N/m
  double last = 20e3;                                    ///< N/m; the search ends there
  std::size_t trials = 1;                                ///< touches at each stiffness
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

// Paper 1's way to the largest stable stiffness (section 4.2): from a start in equal steps upwards until a
// touch is unstable; the last stable stiffness is the result. A start that is already unstable, which the
// paper does not speak of, is left downwards until a touch is stable.

class StiffnessClimb {
 public:
  /// N/m: 0 < step, 0 < first <= last. Throws std::invalid_argument.
  StiffnessClimb(double first, double step, double last) : first_(first), step_(step), last_(last) {
    if (!(step > 0.0 && first > 0.0 && last >= first && last <= 1e7))
      throw std::invalid_argument(
          "the stiffness search needs a start and a step above 0, and an end from the start to 1e7 N/m");
  }

  /// The stiffness to touch next, N/m; none: the search is over.
  std::optional<double> next() const {
    if (given_up_ || (unstable_seen_ && stable_seen_)) return std::nullopt;
    const double stiffness = at(number_);
    if (stiffness > last_ * (1.0 + 1e-12) || stiffness < rounding * step_) return std::nullopt;
    return stiffness;
  }

  /// What next() has been found to be.
  void record(bool stable) {
    if (stable) {
      stable_seen_ = true;
      best_ = at(number_);
    } else {
      unstable_seen_ = true;
    }
    number_ += unstable_seen_ ? -1 : 1;
  }

  /// Ends the search where it is: the touches say nothing any more.
  void give_up() { given_up_ = true; }

  /// The largest stable stiffness so far, N/m; 0: none was.
  double result() const { return best_; }
  /// Nothing was unstable up to the end.
  bool beyond_last() const { return stable_seen_ && !unstable_seen_ && !given_up_ && !next(); }

 private:
  /// Of a step: what is left of it where the way down ends at 0.
  static constexpr double rounding = 1e-9;
  /// Counted in steps, so that they add no rounding.
  double at(int number) const { return first_ + step_ * number; }

  double first_, step_, last_;
  int number_ = 0;
  bool stable_seen_ = false, unstable_seen_ = false, given_up_ = false;
  double best_ = 0.0;
};

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
