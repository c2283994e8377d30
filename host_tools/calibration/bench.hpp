#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/calibration/calibration_settings.hpp"
#include "host_tools/calibration/excitation_plan.hpp"
#include "host_tools/calibration/held_up.hpp"
#include "host_tools/calibration/parameter_journal.hpp"
#include "host_tools/calibration/recording.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::calibration {

// The axis on the test bench: arms it in excitation mode, excites, records, and leaves it disarmed.
//
// The handle stays within settings.travel of where it was when the bench was made: excitation.travel is set
// to what is left of it whenever the axis is armed. Every wait calls `tell`, which may throw to end the
// calibration, and keeps the link alive.
//
// While the axis is armed, a program or a device that is not run for link.timeout, on a busy computer, ends
// with an axis without force. What was under way then is measured again by repeat().
//
// Errors: HeldUp from record(); StepFailed if the axis cannot be armed for a reason that says something about
// the device (supply, encoder) or trips while nothing is recorded; device::DeviceError, link::LinkError. An
// axis that trips during a recording is no error: Recording::trip.
//
// A device that a silent host would leave with its force (link.timeout 0, or above a second) is given a
// link.timeout of a second for as long as the journal lasts: a broken link or a killed program ends the
// force.
class Bench {
 public:
  using Tell = std::function<void(const std::string&)>;

  // `prompter` may be null: then nobody can be asked. `tell` gets a short text, a few times a second.
  Bench(device::Device& device, const CalibrationSettings& settings, ParameterJournal& journal,
        Prompter* prompter, Tell tell);
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  double number(const std::string& name);

  // In RAM, undone by the journal. Parameters that may only change while disarmed disarm the axis.
  void set_temporary(const std::vector<std::string>& texts);
  void set_result(const std::vector<std::string>& texts);
  // Results that would disturb the steps to come: applied when all have passed.
  void set_result_at_end(const std::vector<std::string>& texts);
  void apply_results_at_end();

  // Calls `measure` again, whole, whenever it ends with HeldUp; the axis is disarmed then, and the handle
  // where its momentum has taken it. After `most_silences` in a row a DeviceError says why it cannot be done.
  template <typename Measure>
  auto repeat(Measure measure) -> decltype(measure()) {
    for (int silences = 0;;) {
      try {
        return measure();
      } catch (const HeldUp& held_up) {
        note_silence(++silences, held_up);
      }
    }
  }
  static constexpr int most_silences = 3;

  // Starts the excitation, arming the axis if it is not, and records. Afterwards it goes on until its
  // duration is over unless disarm() ends it or another begins.
  // `reach`: m, of a return from outside the travel; 0: what is left of the travel.
  // HeldUp if the device heard nothing for too long, while it was armed or recorded.
  Recording record(const ExcitationPlan& excitation, const RecordPlan& plan, double reach = 0.0);
  // The same for a record that no later one continues: the axis need not be armed when it has been read, so a
  // silence while the samples, which the device has, are fetched is no HeldUp.
  Recording record_alone(const ExcitationPlan& excitation, const RecordPlan& plan);
  // Records without arming.
  Recording watch(const RecordPlan& plan);
  // Until the excitation's duration is over, or the device has ended it because the host was silent. Throws
  // StepFailed if the axis trips otherwise, DeviceError if the excitation does not end. `longest_still`: s;
  // an encoder that counts nothing for longer disarms the axis. 0: it may.
  void wait_until_finished(double longest_still = 0.0);
  // A fault that is found there is cleared if its cause is gone; arming after it throws StepFailed with it,
  // unless it is that of a handle that coasted out of its travel, or of a silent host.
  void disarm();
  // A fault whose cause stays, or a refusal to arm: nothing more can be measured.
  bool unusable() const { return unusable_; }
  // A trip that disarm() found and nobody has been told of yet.
  std::optional<Trip> take_unseen_trip();
  bool armed() const { return armed_; }

  // m from where the handle was at the beginning; towards +x as the device counts now.
  double displacement();
  // m that may be travelled from there, either way.
  double travel() const { return settings_.travel; }
  // The direction of counting has just been turned, or the origin moved.
  void rehome(double displacement);

  void wait(double seconds);
  void tell(const std::string& text) { tell_(text); }
  const CalibrationSettings& settings() const { return settings_; }
  Prompter* prompter() { return prompter_; }

 private:
  enum class Afterwards { armed, any };
  Recording record_heard(const ExcitationPlan& excitation, const RecordPlan& plan, double reach,
                         Afterwards afterwards);
  Recording record_once(const ExcitationPlan& excitation, const RecordPlan& plan, double reach,
                        Afterwards afterwards);
  void require_heard(const Trip& trip) const;
  void require_heard_after(const device::DeviceError& error);
  void note_silence(int silences, const HeldUp& held_up);
  void arm(double reach);
  void arm_when_ready();
  Trip cleared(const device::DriveStatus& status);
  std::optional<Trip> trip();
  void begin_capture(device::CaptureReader& reader, const RecordPlan& plan, firmware::CaptureTrigger trigger);
  Recording finish_capture(device::CaptureReader& reader, Afterwards afterwards);
  void begin_still_watch(double longest_still);
  bool stands();

  device::Device& device_;
  CalibrationSettings settings_;
  ParameterJournal& journal_;
  Prompter* prompter_;
  Tell tell_;
  device::Drive drive_;
  double home_ = 0.0;             // m
  double timeout_ = 1.0;          // s, link.timeout
  double longest_silence_ = 0.1;  // s
  unsigned run_ = 0;
  bool armed_ = false;
  bool unusable_ = false;
  std::chrono::microseconds next_look();

  std::size_t looks_ = 0;
  double longest_still_ = 0.0;  // s; 0: nobody wants to know
  double still_count_ = 0.0;
  std::chrono::microseconds still_since_{};
  std::optional<Trip> unseen_trip_;
  std::vector<std::string> results_at_end_;
};

}  // namespace kmax::calibration
