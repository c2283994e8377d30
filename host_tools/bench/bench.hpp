#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware/parameters/refusal.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/bench/excitation.hpp"
#include "host_tools/bench/held_up.hpp"
#include "host_tools/bench/journal.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::bench {

/// The axis lost its force by itself, or could not be armed because of a fault.
class AxisTripped : public std::runtime_error {
 public:
  explicit AxisTripped(Trip trip) : std::runtime_error(trip.words), trip_(std::move(trip)) {}
  const Trip& trip() const { return trip_; }

 private:
  Trip trip_;
};

/// The device refuses to arm the axis.
class ArmingRefused : public std::runtime_error {
 public:
  ArmingRefused(firmware::Refusal refusal, const char* words)
      : std::runtime_error(words), refusal_(refusal) {}
  firmware::Refusal refusal() const { return refusal_; }

 private:
  firmware::Refusal refusal_;
};

/// DeviceError if any axis is armed.
void require_disarmed(device::Device& device);

/// An axis on the test bench: arms it in excitation mode, excites, captures, and leaves it disarmed and its
/// parameters as they were.
///
/// Armed it is with kind `voltage` and no run of the excitation under way: zero volts, never a current
/// controller, which an inverted current sensor or gains that do not fit the motor would drive up. Zero volts
/// short the motor and brake what an excitation has set in motion.
///
/// The handle stays within `travel` of where it was when the bench was made: excitation.travel is set to what
/// is left of it whenever the axis is armed. Every wait calls `progress`, which may throw to end the work,
/// and keeps the link alive.
///
/// While the axis is armed, a program or a device that is not run for link.timeout, on a busy computer, ends
/// with an axis without force. What was under way then is measured again by repeat().
///
/// A device that a silent host would leave with its force (link.timeout 0, or above a second) is given a
/// link.timeout of a second before the axis is armed: a broken link or a killed program ends the force.
///
/// Errors: HeldUp from record(); ArmingRefused; AxisTripped if it trips while nothing is captured;
/// base::DeviceError, device::LinkError. An axis that trips during a capture is no error: Waveforms::trip.
class Bench {
 public:
  using Progress = std::function<void(const std::string&)>;

  /// `travel`: m. `progress` gets a short text, or an empty one, a few times a second. Changes nothing.
  Bench(device::Device& device, std::size_t axis, double travel, Progress progress);
  /// Disarms, and the journal puts back what it still has.
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  double number(const std::string& name);

  /// In RAM, undone by the journal. Parameters that may only change while disarmed disarm the axis.
  void set_temporary(const std::vector<std::string>& texts);
  void set_result(const std::vector<std::string>& texts);
  /// Notes what captures change, and sees to link.timeout: before anything else is measured. arm() does it
  /// otherwise.
  void begin();

  /// Calls `measure` again, whole, whenever it ends with HeldUp; the axis is disarmed then, and the handle
  /// where its momentum has taken it. After `most_silences` in a row a DeviceError says why it cannot be
  /// done.
  template <typename Measure>
  auto repeat(Measure measure) -> decltype(measure()) {
    return repeat_if_held_up(measure, [this](const std::string& text) { progress_(text); });
  }

  /// Starts the excitation, arming the axis if it is not, and captures. Afterwards it goes on until its
  /// duration is over unless disarm() ends it or another begins.
  /// `reach`: m, of a return from outside the travel; 0: what is left of the travel.
  /// HeldUp if the device heard nothing for too long, while it was armed or captured.
  Waveforms record(const ExcitationPlan& excitation, const CapturePlan& plan, double reach = 0.0);
  /// The same for a capture that no later one continues: the axis need not be armed when it has been read, so
  /// a silence while the samples, which the device has, are fetched is no HeldUp.
  Waveforms record_alone(const ExcitationPlan& excitation, const CapturePlan& plan);
  /// Captures without arming.
  Waveforms watch(const CapturePlan& plan);

  /// Zero volts; what is armed stays so. A power stage that is still starting is waited for, up to 2 s.
  /// HeldUp likewise.
  void arm(double reach = 0.0);
  /// Whether the axis, which has been armed, has tripped meanwhile.
  std::optional<Trip> trip();
  /// A fault that is found there is cleared if its cause is gone; arming after it throws AxisTripped with it,
  /// unless it is that of a handle that coasted out of its travel, or of a silent host.
  void disarm();
  /// A fault whose cause stays, or a refusal to arm: nothing more can be measured.
  bool unusable() const { return unusable_; }
  /// A trip that disarm() found and nobody has taken yet.
  std::optional<Trip> take_unseen_trip();

  /// m from where the handle was at the beginning; towards +x as the device counts now.
  double displacement();
  /// m that may be travelled from there, either way.
  double travel() const { return travel_; }
  /// The direction of counting has just been turned, or the origin moved.
  void rehome(double displacement);

  /// s of the host's silence after which the device removes the force.
  double link_timeout() const { return timeout_; }
  void wait(double seconds);
  void progress(const std::string& text) { progress_(text); }
  Journal& journal() { return journal_; }
  device::Drive& drive() { return drive_; }

 private:
  enum class Afterwards { armed, any };
  Waveforms record_heard(const ExcitationPlan& excitation, const CapturePlan& plan, double reach,
                         Afterwards afterwards);
  Waveforms record_once(const ExcitationPlan& excitation, const CapturePlan& plan, double reach,
                        Afterwards afterwards);
  void require_heard(const Trip& trip) const;
  void require_heard_after(const base::DeviceError& error);
  void arm_when_ready();
  Trip cleared(const device::DriveStatus& status);
  void begin_capture(device::CaptureReader& reader, const CapturePlan& plan,
                     firmware::CaptureTrigger trigger);
  Waveforms finish_capture(device::CaptureReader& reader, Afterwards afterwards, bool brakes);
  // Until the excitation's duration is over, the axis has tripped, or the encoder stands for longer than
  // allowed.
  void finish_and_brake(Waveforms& seen);
  // Shorts the winding for a tenth of a second, whatever the encoder says. The axis stays armed, at zero
  // volts, unless it trips. A handle of 0.1 kg with little friction, let go at 0.6 m/s, would coast for 60
  // mm.
  void brake();
  void begin_still_watch(const StillLimits& limits);
  std::chrono::microseconds next_look();
  bool stands();

  device::Device& device_;
  device::Drive drive_;
  Journal journal_;  // outlives what is done by the destructor, which disarms
  Progress progress_;
  double travel_;
  double home_ = 0.0;             // m
  double timeout_ = 1.0;          // s, link.timeout
  double longest_silence_ = 0.1;  // s
  unsigned run_ = 0;
  bool begun_ = false;
  bool armed_ = false;
  bool unusable_ = false;

  std::size_t looks_ = 0;
  StillWatch still_watch_;
  std::optional<Trip> unseen_trip_;
};

}  // namespace kmax::bench
