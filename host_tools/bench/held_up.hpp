#pragma once
// What a host that was not run for a while means for a measurement on a device: it is made again.
//
// A program, the other end of its link or a simulated device that gets no processor time for link.timeout
// falls silent, and the device removes the force, as it should. That says nothing about the axis. What was
// under way is cut off and made again, whole; every other fault, refusal or stop has a reason that somebody
// must look at.

#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/base/numbers.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::bench {

/// The device heard nothing for link.timeout and has removed the force.
struct HeldUp {
  double silence = 0.0;  ///< s
};

/// What is made again this often in a row cannot be made.
inline constexpr int most_silences = 3;

/// Whether the axis has lost its force to a silent host.
bool heard_nothing(const device::DriveStatus& status);
/// Whether this program has given up what it was doing since it had not been run (base::StoodStill).
bool stood_still(const std::exception& error);

/// Throws DeviceError if this is `most_silences` in a row.
void require_another_try(int silences, const HeldUp& held_up);

/// Calls `measure` again, whole, whenever it ends with HeldUp; before that `again` gets a short text. Throws
/// DeviceError after `most_silences` in a row.
template <typename Measure, typename Again>
auto repeat_if_held_up(Measure measure, Again again) -> decltype(measure()) {
  for (int silences = 0;;) {
    try {
      return measure();
    } catch (const HeldUp& held_up) {
      require_another_try(++silences, held_up);
      again("measuring again: the device heard nothing for " + base::number_text(held_up.silence) + " s");
    }
  }
}

/// For work that a person does with the handle, on several axes, over any link: whether a standstill was what
/// ended it, and whether it can be done again.
class Standstill {
 public:
  using Notice = std::function<void(const std::string&)>;

  /// `axes`: all that are armed. `notice`, which may be empty, gets one line on all that is thrown away.
  Standstill(device::Device& device, std::vector<std::size_t> axes, Notice notice)
      : device_(device), axes_(std::move(axes)), notice_(std::move(notice)) {}

  /// Before the work: asks how long the device has been running. Errors as Device.
  void begin();

  /// After the work has ended with `error`. A standstill was the cause if an axis has the fault link_silent;
  /// and also if the device did not answer (device::LinkError) or this program had to give up what it was
  /// doing (base::StoodStill), and the device is in order. Then the axes are disarmed, link_silent is
  /// cleared, and `notice` gets a line that begins with `name`. Parameters are left alone: lowered limits
  /// stay.
  ///
  /// Never if one of the axes has another fault or was stopped, if the device cannot be reached now, or if it
  /// has been restarted, which lost the limits. Then no fault is cleared. Throws only what `notice` does.
  bool cut_off(const std::exception& error, const std::string& name) const;

 private:
  bool make_ready(const std::exception& error, std::string& why) const;

  device::Device& device_;
  std::vector<std::size_t> axes_;
  Notice notice_;
  std::uint32_t uptime_ = 0;  ///< s, of the device
};

}  // namespace kmax::bench
