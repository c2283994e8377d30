#pragma once
// What every experiment does with the touches that a person makes on a device: one that did not count, or
// that was cut off because this computer stood still, is made again; each that is over is in a journal at
// once, so that nothing is lost when the run ends early.

#include <functional>
#include <string>

#include <fmt/format.h>

#include "host_tools/bench/held_up.hpp"
#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

inline constexpr int touch_attempts = 3;
inline constexpr int most_standstills = 3;  ///< that one touch survives

/// What the touches depend on besides an experiment's own settings, for a journal: the device's identity, and
/// the parameters of this axis that no experiment sets.
RunJournal::Json device_circumstances(device::Device& device, std::size_t axis);

struct TouchSession {
  bench::Prompter* prompter = nullptr;  ///< null: nobody is asked
  RunJournal* journal = nullptr;        ///< null: none is kept
  const ReportText& report;
  bench::Standstill* standstill = nullptr;  ///< null: a touch that was cut off is an error
};

/// Why it is made again.
template <typename Touch>
std::string reason_not_to_count(const Touch& touch) {
  if constexpr (requires { touch.lost_records; }) {
    if (touch.lost_records > 0) return fmt::format("{} records of its trace were lost", touch.lost_records);
  }
  return "the handle was not in the wall when it was judged";
}

/// The touch that `once` makes. One that does not count (Touch::counts()), or that nobody made although
/// somebody was asked, is made again, up to three times in all; the last one that does not count is returned.
/// One that a standstill cut off (bench/held_up.hpp) is made again up to three times more.
/// Errors: those of `once`; NobodyTouched without a prompter or after the third time.
template <typename Touch>
Touch repeated_touch(const TouchSession& session, const std::string& name,
                     const std::function<Touch()>& once) {
  int standstills = 0;
  const auto was_cut_off = [&](const std::exception& error) {
    if (session.standstill == nullptr || standstills == most_standstills) return false;
    if (!session.standstill->cut_off(error, name)) return false;
    ++standstills;
    session.report(fmt::format("{}: once more", name));
    return true;
  };
  for (int attempt = 1;;) {
    try {
      if (session.standstill != nullptr) session.standstill->begin();
      Touch touch = once();
      if (touch.counts()) return touch;
      session.report(fmt::format("{}: {}; once more", name, reason_not_to_count(touch)));
      if (attempt++ == touch_attempts) return touch;
    } catch (const base::DeviceError& error) {
      // Nobody touches a wall whose force was removed unseen.
      if (was_cut_off(error)) continue;
      const bool nobody = dynamic_cast<const NobodyTouched*>(&error) != nullptr;
      if (!nobody || session.prompter == nullptr || attempt++ == touch_attempts) throw;
    } catch (const device::LinkError& error) {
      if (!was_cut_off(error)) throw;
    }
  }
}

template <typename Touch>
concept kept_in_a_journal = requires(RunJournal::Json json, const RunJournal::Json& known, Touch touch) {
  to_json(json, touch);
  from_json(known, touch);
};

/// The touch that the journal has under `key`; else repeated_touch(), put into the journal if it counts: a
/// run that is resumed tries again what did not.
///
/// Touch has to_json(RunJournal::Json&, const Touch&) and from_json(const RunJournal::Json&, Touch&). Errors:
/// those of repeated_touch(); JournalError.
template <typename Touch>
Touch journaled_touch(const TouchSession& session, const std::string& key, const std::string& name,
                      const std::function<Touch()>& once) {
  if (const RunJournal::Json* known = session.journal != nullptr ? session.journal->find(key) : nullptr) {
    try {
      Touch touch;
      from_json(*known, touch);
      return touch;
    } catch (const std::exception&) {
      throw JournalError(fmt::format("{}: '{}' is not what this experiment writes; begin without --resume",
                                     session.journal->file().string(), key));
    }
  }
  Touch touch = repeated_touch(session, name, once);
  if (session.journal != nullptr && touch.counts()) {
    RunJournal::Json json;
    to_json(json, touch);
    session.journal->add(key, json);
  }
  return touch;
}

}  // namespace kmax::experiment
