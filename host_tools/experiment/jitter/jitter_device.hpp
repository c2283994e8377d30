#pragma once
// Table I on a device that a person holds (jitter_experiment.hpp says what is measured): for each pair of
// forces the person is asked to touch the wall and to keep the handle there.

#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/experiment/jitter/jitter_experiment.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

struct JitterDeviceSettings {
  std::size_t axis = 0;
  JitterWall wall;
  int touches = 3;                                ///< per pair of forces
  double force_limit = paper::touch_force_limit;  ///< N; force.limit is lowered to it
  double abort_amplitude = 0.03;                  ///< m; the paper's jitter reaches 10 mm
  double patience = 20.0;                         ///< s for the person to come to the wall
  std::vector<paper::JitterCell> pairs{paper::table_1.begin(), paper::table_1.end()};
};

/// One touch, as a journal keeps it.
struct JitterDeviceTouch {
  JitterMeasure measure;  ///< nothing if aborted
  bool aborted = false;
  double limited_share = 0.0;
  std::uint64_t lost_records = 0;
  bool counts() const { return aborted || measure.touched; }
};
void to_json(RunJournal::Json& json, const JitterDeviceTouch& touch);
void from_json(const RunJournal::Json& json, JitterDeviceTouch& touch);  ///< throws what is wrong

/// Everything the touches depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const JitterDeviceSettings& settings);

struct JitterDeviceResult {
  std::vector<JitterResult> results;
  double force_limit = 0.0;    ///< N, that was at work: a pair beyond it is not what the paper had
  double limited_share = 0.0;  ///< greatest share of limited samples in a touch
  std::uint64_t lost_records = 0;
};

/// `prompter` null: nobody is asked, as a simulated person needs no asking. An aborted touch is counted, not
/// averaged. Changes only parameters of one axis and link.timeout, and puts them back; `notice` is told if
/// that fails. `journal` may be null; touches are made again and kept as touch_journal.hpp says. Errors as
/// watch_touch(), device::ValueError, JournalError.
JitterDeviceResult run_jitter_on_device(device::Device& device, const JitterDeviceSettings& settings,
                                        calibration::Prompter* prompter, const Tell& tell,
                                        RunJournal* journal = nullptr, const Tell& notice = {});

/// What the device is set to for one pair, NAME=VALUE.
std::vector<std::string> jitter_assignments(const JitterWall& wall, const paper::JitterCell& pair);

}  // namespace kmax::experiment
