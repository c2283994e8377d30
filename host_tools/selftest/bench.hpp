#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/selftest/evidence.hpp"
#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

/// The handle stands where the test has not moved it.
class HandleMoved : public device::DeviceError {
 public:
  using device::DeviceError::DeviceError;
};

/// What the self-test does to an axis: small voltages with everything recorded, and nothing left behind.
///
/// The axis is armed in mode `excitation` with kind `voltage` and zero volts, never with a current
/// controller: with an inverted current sensor that would drive the current up. Zero volts short the motor,
/// so what a pulse has set in motion is braked while the recording is read.
///
/// Arming starts no run of the excitation, and with no run under way kind `voltage` is zero volts (not a
/// current of zero): so it is from the first tick on. A pulse is a run that is started afterwards.
///
/// While it is armed link.timeout is 1 s, whatever it was: a program that is killed, or a cable that is
/// pulled, leaves no force. A program that merely was not run for a second, on a busy computer, finds an axis
/// that is off: that says nothing about the axis. What was under way, arming or a pulse, is done again, and
/// after `most_silences` of them in a row a DeviceError says why it cannot be done.
///
/// Before the first change all parameters that are used are remembered; leave() disarms and puts them back,
/// and so does the destructor if nobody has called it. Errors: DeviceError and link::LinkError, from every
/// call but leave(); whatever `tell` throws (an interruption) passes through.
class Bench {
 public:
  using Tell = std::function<void(const std::string&)>;
  enum class Observe { position, supply };

  /// Throws DeviceError if any axis is armed.
  Bench(device::Device& device, std::size_t axis, Tell tell);
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  /// What has become of the device, in words for the user.
  struct Left {
    bool in_order = false;  ///< disarmed, and every parameter as it was
    std::string words;
  };
  /// Disarms and puts all parameters back, as far as that can be done. Throws nothing of the device or link.
  Left leave();

  /// The fault that was there before the test, if any. It is cleared if its cause is gone.
  std::optional<FaultAtStart> clear_fault_at_start();
  /// A fault whose cause remains stays: arming will name it.
  void clear_fault();
  LinkTrial try_link(int exchanges);
  /// Arms with zero volts for a moment. A power stage that is still starting is waited for, up to 2 s.
  /// Throws DeviceError if the axis was off for the host's silence every time.
  ArmingTrial try_arming();
  /// Arms with zero volts and stays so. False: it cannot be armed.
  bool arm_with_zero_volts();
  /// Bridge off.
  Recording record_rest(std::size_t samples);
  /// One pulse. A trip ends it and is in the recording; its fault is cleared. A pulse around which the host
  /// was silent is given again. Throws HandleMoved if something else has moved the handle: nothing has been
  /// given then.
  Recording give(const Pulse& pulse, Observe observe = Observe::position);
  std::vector<double> read_supply(int readings);

  double number(const char* name);
  /// m, from where the handle was at the start, by the encoder; and the largest so far.
  double displacement();
  /// m, likewise, without counting as a displacement: for what a hand does.
  double position_now();
  double largest_displacement() const { return largest_displacement_; }

  void tell(const std::string& text) { tell_(text); }
  device::Drive& drive() { return drive_; }
  device::Device& device() { return device_; }
  std::size_t axis() const { return axis_; }
  /// Sets parameters of the axis, "NAME=VALUE".
  void set(const std::vector<std::string>& assignments);

  /// m: the trip level of the whole test.
  static constexpr double travel = Evidence::travel;
  /// s: link.timeout during the test. While it is armed the device hears of the host every 20 ms.
  static constexpr double longest_silence = 1.0;
  static constexpr int most_silences = 3;
  /// m: no pulse is given farther than this from the start.
  static constexpr double farthest_start = 0.6e-3;

 private:
  void remember();
  bool disarm(Left& left);
  bool put_back(Left& left);
  void arm_quietly();
  std::optional<Recording> try_to_give(const Pulse& pulse, Observe observe);
  Recording give_once(const Pulse& pulse, Observe observe);
  void note_silence(int silences);
  void take_counts(const std::vector<double>& counts, Recording& recording);
  double distance_from_start(double counts) const;

  device::Device& device_;
  std::size_t axis_;
  Tell tell_;
  device::Drive drive_;
  std::vector<device::Assignment> before_;
  std::optional<FaultAtStart> fault_at_start_;
  bool changed_ = false;    ///< a parameter
  bool may_drive_ = false;  ///< it has been armed, and not been disarmed since
  std::uint32_t run_ = 0;
  double count_length_ = 0.0, first_count_ = 0.0, tick_ = 50e-6;
  double largest_displacement_ = 0.0;
};

}  // namespace kmax::selftest
