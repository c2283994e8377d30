#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/bench/bench.hpp"
#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

/// The handle stands where the test has not moved it.
class HandleMoved : public base::DeviceError {
 public:
  using base::DeviceError::DeviceError;
};

/// What has become of the device, in words for the user.
struct Restored {
  bool in_order = false;  ///< disarmed, and every parameter as it was
  std::string words;
};

/// What the self-test does to an axis on the bench: small voltages with everything captured, and nothing left
/// behind. A pulse is a run of the excitation that is started on an axis that is armed with zero volts.
///
/// restore() disarms and puts all parameters back, and so does the destructor if nobody has called it.
/// Errors: as Bench, from every call but restore(); whatever `progress` throws (an interruption) passes
/// through.
class Probe {
 public:
  using Progress = bench::Bench::Progress;
  enum class Observe { position, supply };

  /// Throws DeviceError if any axis is armed. Changes nothing.
  Probe(device::Device& device, std::size_t axis, Progress progress);

  /// As far as that can be done. Throws nothing of the device or link.
  Restored restore();

  /// The fault that was there before the test, if any. It is cleared if its cause is gone.
  std::optional<FaultAtStart> clear_fault_at_start();
  /// A fault whose cause remains stays: arming will name it.
  void clear_fault();
  LinkTrial try_link(int exchanges);
  /// Arms with zero volts for a moment.
  ArmingTrial try_arming();
  /// Arms with zero volts and stays so. False: it cannot be armed.
  bool arm_with_zero_volts();
  /// Bridge off.
  PulseResponse watch_at_rest(std::size_t samples);
  /// One pulse. A trip ends it and is in the response; its fault is cleared. A pulse around which the host
  /// was silent is given again. Throws HandleMoved if something else has moved the handle: nothing has been
  /// given then.
  PulseResponse give(const Pulse& pulse, Observe observe = Observe::position);
  std::vector<double> read_supply(int readings);

  /// m, from where the handle was at the start, by the encoder; and the largest so far.
  double displacement();
  /// m, likewise, without counting as a displacement: for what a hand does.
  double position_now() { return distance_from_start(bench_.number("measured.count")); }
  double largest_displacement() const { return largest_displacement_; }

  bench::Bench& bench() { return bench_; }
  device::Device& device() { return device_; }

  /// m: no pulse is given farther than this from the start.
  static constexpr double farthest_start = 0.6e-3;

 private:
  bool disarm(std::string& words);
  bool put_back(std::string& words);
  PulseResponse response_of(const bench::Waveforms& seen);
  double distance_from_start(double counts) const;

  device::Device& device_;
  bench::Bench bench_;
  std::optional<FaultAtStart> fault_at_start_;
  double count_length_ = 0.0, first_count_ = 0.0, tick_ = firmware::tick_interval;
  double largest_displacement_ = 0.0;
};

}  // namespace kmax::selftest
