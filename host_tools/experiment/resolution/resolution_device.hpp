#pragma once
// Paper 2's experiment (resolution_experiment.hpp) on a device that a person holds: for each resolution the
// person is asked to touch the wall slowly and fast. Nobody keeps a speed that is asked for: the one of the
// recording counts.
//
// The position that a device records is the re-sampled one. A handle that moves across the border between two
// steps of 0.4 mm shows a whole step, more than the threshold, however little it moves: taken as vibration,
// since the person feels the force jump by K eta.

#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/experiment/limited_touches.hpp"
#include "host_tools/experiment/resolution/resolution_experiment.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

struct ResolutionDeviceSettings : TouchLimits {
  ResolutionWall wall;
  std::vector<double> resolutions{0.0, 0.1e-3, 0.4e-3};  ///< m
  std::vector<double> speeds{0.05, 0.08, 0.15, 0.3};     ///< m/s, asked of the person
  int touches = 1;                                       ///< for each
};

/// One touch, as a journal keeps it.
struct ResolutionDeviceTouch {
  double speed = 0.0;  ///< m/s, measured
  bool unstable = false, without_contact = false, aborted = false;
  double peak_to_peak = 0.0;  ///< m
  std::uint64_t lost_records = 0;
  bool counts() const { return !without_contact; }
};
void to_json(RunJournal::Json& json, const ResolutionDeviceTouch& touch);
void from_json(const RunJournal::Json& json, ResolutionDeviceTouch& touch);  ///< throws what is wrong

/// Everything the touches depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const ResolutionDeviceSettings& settings);

struct ResolutionDeviceResult {
  std::vector<ResolutionCell> cells;  ///< one for each touch, with the speed that was measured
  std::vector<double> asked_speeds;   ///< m/s, of the same touches
  std::vector<bool> aborted;          ///< likewise: taken as vibrating
  double force_limit = 0.0;           ///< N, at work
  std::uint64_t lost_records = 0;
};

/// LimitedTouches on one axis, for `prompter`, `tell`, `journal` and `notice`. Errors as watch_touch(),
/// device::ValueError, JournalError.
ResolutionDeviceResult run_resolution_on_device(device::Device& device,
                                                const ResolutionDeviceSettings& settings,
                                                calibration::Prompter* prompter, const Tell& tell,
                                                RunJournal* journal = nullptr, const Tell& notice = {});

/// Towards the wall, m/s, over the last 30 ms before time 0; 0 without samples there.
double touch_speed(const WatchedTouch& touch);

}  // namespace kmax::experiment
