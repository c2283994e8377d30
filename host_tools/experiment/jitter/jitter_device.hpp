#pragma once
// Table I on a device that a person holds (jitter_experiment.hpp says what is measured): for each pair of
// forces the person is asked to touch the wall and to keep the handle there.

#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/experiment/jitter/jitter_experiment.hpp"
#include "host_tools/experiment/limited_touches.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

struct JitterDeviceSettings : TouchLimits {
  JitterDeviceSettings() { abort_amplitude = 0.03; }  // the paper's jitter reaches 10 mm

  JitterWall wall;
  int touches = 3;  ///< per pair of forces
  std::vector<paper::JitterCell> pairs{paper::table_1.begin(), paper::table_1.end()};
};

/// One touch, as a journal keeps it.
struct JitterDeviceTouch {
  JitterMeasure measure;  ///< nothing if aborted
  bool aborted = false;
  double limited_share = 0.0;
  std::uint64_t lost_records = 0;
  /// A jitter that fell into a gap of the trace was never seen.
  bool counts() const { return aborted || (measure.touched && lost_records == 0); }
};
void to_json(RunJournal::Json& json, const JitterDeviceTouch& touch);
void from_json(const RunJournal::Json& json, JitterDeviceTouch& touch);  ///< throws what is wrong

/// Everything the touches depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const JitterDeviceSettings& settings);

struct JitterDeviceResult {
  std::vector<JitterResult> results;
  double force_limit = 0.0;        ///< N, that was at work: a pair beyond it is not what the paper had
  double limited_share = 0.0;      ///< greatest share of limited samples in a touch
  std::uint64_t lost_records = 0;  ///< of touches that were aborted, or not counted for it
};

/// LimitedTouches on one axis, for `prompter`, `tell`, `journal` and `notice`. An aborted touch is counted,
/// not averaged. One that lost records of its trace every time it was made is neither; `notice` is told.
/// Errors as watch_touch(), device::ValueError, JournalError.
JitterDeviceResult run_jitter_on_device(device::Device& device, const JitterDeviceSettings& settings,
                                        calibration::Prompter* prompter, const Tell& tell,
                                        RunJournal* journal = nullptr, const Tell& notice = {});

/// What the device is set to for one pair, NAME=VALUE.
std::vector<std::string> jitter_assignments(const JitterWall& wall, const paper::JitterCell& pair);

}  // namespace kmax::experiment
