#pragma once
// The touches of one experiment on a device that a person holds: what is the same for all of them, whatever
// wall they are of and whatever is measured.
//
// Before anybody is asked for anything, the limits that keep the person safe are at work (TouchLimits,
// protective_assignments()), and what they were is known, to be put back at the end. Each touch is asked for,
// watched within these limits (watched_touch.hpp), made again if it did not count or if a standstill of this
// computer cut it off (standstill.hpp), and kept in the journal (touch_journal.hpp).

#include <functional>
#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/restored_afterwards.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/standstill.hpp"
#include "host_tools/experiment/touch_journal.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

/// Of every touch of an experiment; its settings derive from this.
struct TouchLimits {
  std::size_t axis = 0;                           ///< of the wall
  double force_limit = paper::touch_force_limit;  ///< N; force.limit is lowered to it
  double abort_amplitude = 0.01;                  ///< m; TouchWatch::abort_amplitude
  double patience = 20.0;                         ///< s for the person to come to the wall
  double wall_abort_amplitude = 1e-3;  ///< m, against a wall that forces act along: two_axis_touch.hpp
};

/// The watch of one touch: `name` is what is touched, `hold_time` in s.
TouchWatch watch_within(const TouchLimits& limits, const std::string& name, double hold_time);

/// Everything the touches of `experiment` depend on, for a journal: the device's circumstances, the
/// experiment's `own` settings (an object), the limits. Not the patience, which no touch depends on.
RunJournal::Json touch_settings(const std::string& experiment, device::Device& device,
                                const TouchLimits& limits, const RunJournal::Json& own);

/// Who makes the touches, and who is told of them.
struct TouchParty {
  calibration::Prompter* prompter =
      nullptr;                    ///< null: nobody is asked, as a simulated person needs no asking
  RunJournal* journal = nullptr;  ///< null: none is kept
  const Tell& tell;               ///< progress; what it throws ends the experiment
  const Tell& notice;             ///< what went wrong and was lived with; may be empty
};

/// While it lives, the limits are at work. Afterwards all parameters are as they were, however it ends; the
/// party's notice is told if that fails. Every axis must be disarmed by then, as watch_touch() leaves it.
class LimitedTouches {
 public:
  /// `changed`: every parameter that the experiment is going to set, NAME=VALUE or NAME, a name without
  /// prefix is on limits.axis. `further_axes`: those that are armed besides it; their force limits are
  /// lowered to the same. Reads them all, then writes in one transaction, of each axis in turn, what
  /// protective_assignments() asks for. The device and the party must outlive this. Errors as
  /// Device::apply().
  LimitedTouches(device::Device& device, const TouchLimits& limits, const std::vector<std::string>& changed,
                 const TouchParty& party, const std::vector<std::size_t>& further_axes = {});

  /// At work on limits.axis, N: the device's own if that is lower.
  double force_limit() const { return force_limit_; }

  /// In one transaction; a name without prefix is on limits.axis. Errors as Device::apply().
  void set(const std::vector<std::string>& assignments);

  /// Asks the person, if there is one, and comes back when they are ready. What the prompter throws ends the
  /// experiment.
  void ask(const std::string& what_to_do) const;

  /// journaled_touch(): the touch that `once` makes, or the journal's under `key`.
  template <typename Touch>
  Touch touch(const std::string& key, const std::string& name, const std::function<Touch()>& once) const {
    return journaled_touch<Touch>(session_, key, name, once);
  }

  /// watch_touch() within the limits, its progress told to the party.
  WatchedTouch watch(const std::string& name, double hold_time) const;

  const Tell& tell() const { return session_.tell; }
  const TouchSession& session() const { return session_; }

 private:
  device::Device& device_;
  TouchLimits limits_;
  std::vector<std::string> protective_;
  RestoredAfterwards restored_;
  Standstill standstill_;
  TouchSession session_;
  double force_limit_ = 0.0;
};

}  // namespace kmax::experiment
