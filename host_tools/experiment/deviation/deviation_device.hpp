#pragma once
// Table II on a device with two axes (deviation_experiment.hpp): the wall's axis is the normal, the other one
// lies along the surface and takes the interference, which the firmware passes from axis to axis. The person
// presses the handle against the wall and keeps it there while it is pushed sideways, five times without and
// five times with a background force.
//
// A person simulated on a device answers to F_B on the wall's axis, and on the other one where its scene says
// that it is the same person's hand (operator.same_person). The scene's push must exceed F_B, since what the
// person adds against F_B lags behind the onset, and its hold last for the whole touch; whoever lets go
// sooner swings out of the wall, which ends the touch. The supplied scene paper1_deviation holds for 15 s.

#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/experiment/deviation/deviation_experiment.hpp"
#include "host_tools/experiment/deviation/deviation_touch.hpp"
#include "host_tools/experiment/limited_touches.hpp"
#include "host_tools/experiment/run_journal.hpp"

namespace kmax::experiment {

/// The limits' axis is the wall's; the other one lies along the surface. force_limit is of both,
/// abort_amplitude along the surface.
struct DeviationDeviceSettings : TouchLimits {
  DeviationDeviceSettings() { abort_amplitude = 0.05; }  // the paper's deviation reaches 17 mm

  DeviationProtocol protocol;
  double wall_abort_amplitude = 1e-3;  ///< m, against the wall: a plain wall that is unstable shows more
  std::vector<paper::DeviationCell> pairs{paper::table_2.begin(), paper::table_2.end()};
};

/// A touch with less contact (DeviationTouch::contact_share) is not averaged: without the wall there is no
/// F_I.
inline constexpr double least_contact = 0.95;

/// One touch, as a journal keeps it.
struct DeviationDeviceTouch {
  DeviationMeasure measure;
  double contact_share = 0.0, limited_share = 0.0;
  bool aborted = false;
  std::uint64_t lost_records = 0;
  bool counts() const { return aborted || contact_share >= least_contact; }
};
void to_json(RunJournal::Json& json, const DeviationDeviceTouch& touch);
void from_json(const RunJournal::Json& json, DeviationDeviceTouch& touch);  ///< throws what is wrong

/// Everything the touches depend on, for a journal.
RunJournal::Json journal_settings(device::Device& device, const DeviationDeviceSettings& settings);

struct DeviationDeviceResult {
  std::vector<DeviationResult> results;
  double force_limit = 0.0;  ///< N, at work on the wall's axis
  double limited_share = 0.0;
  std::uint64_t lost_records = 0;
};

/// LimitedTouches on both axes, for `prompter`, `tell`, `journal` and `notice`. One touch for each pair of
/// forces; an aborted one is counted, not averaged. Pulses are switched by the host, at the link's pace; when
/// each was really switched is what its deviation is measured from. Errors as watch_touch(),
/// device::ValueError, JournalError.
DeviationDeviceResult run_deviation_on_device(device::Device& device, const DeviationDeviceSettings& settings,
                                              calibration::Prompter* prompter, const Tell& tell,
                                              RunJournal* journal = nullptr, const Tell& notice = {});

/// The pulses and the onset of one touch, as changes in time.
std::vector<TimedChange> deviation_changes(const DeviationProtocol& protocol, double background,
                                           double interference);

}  // namespace kmax::experiment
