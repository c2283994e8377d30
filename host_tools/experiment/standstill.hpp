#pragma once
// A touch that nothing was wrong with but that this computer stood still: what makes it possible again.
//
// A program or a simulated device that gets no processor time for a second falls silent in the middle of a
// touch, and the device removes the force (link.timeout), as it should. Such a touch says nothing of the wall
// and is made again; every other fault, refusal or stop has a reason that somebody must look at.

#include <cstdint>
#include <exception>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {

class Standstill {
 public:
  /// `axes`: all that the touches arm. `notice`, which may be empty, is told of every touch that is thrown
  /// away, in one line.
  Standstill(device::Device& device, std::vector<std::size_t> axes, Tell notice);

  /// Before a touch: asks how long the device has been running. Errors as Device.
  void touch_begins();

  /// After a touch has ended with `error`: whether a standstill was the cause, and another touch can be made.
  /// It was if an axis has the fault link_silent; and also if the device did not answer (link::LinkError) or
  /// this program had to give up what it was doing (device::StoodStill), and the device is in order. Then the
  /// axes are disarmed, link_silent is cleared, and `notice` is told. Parameters are left alone: lowered
  /// limits stay.
  ///
  /// Never if one of the axes has another fault or was stopped, if the device cannot be reached now, or if it
  /// has been started anew, which lost the limits. Then no fault is cleared. Throws only what `notice` does.
  bool cut_off(const std::exception& error, const std::string& touch) const;

 private:
  bool make_ready(const std::exception& error, std::string& why) const;

  device::Device& device_;
  std::vector<std::size_t> axes_;
  Tell notice_;
  std::uint32_t uptime_ = 0;  ///< s, of the device
};

}  // namespace kmax::experiment
