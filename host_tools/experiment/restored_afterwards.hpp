#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::experiment {

/// The parameters that an experiment is going to change, read when this begins and put back in one
/// transaction when it ends, however it ends. The axis must be disarmed by then. If that fails, `notice` is
/// told why, and what was there before as NAME=VALUE, to be set by hand.
class RestoredAfterwards {
 public:
  using Notice = std::function<void(const std::string&)>;

  /// `changed`: NAME=VALUE or NAME each, a name without prefix is on `axis`. Errors as Device.
  RestoredAfterwards(device::Device& device, std::size_t axis, const std::vector<std::string>& changed,
                     Notice notice = {});
  ~RestoredAfterwards();
  RestoredAfterwards(const RestoredAfterwards&) = delete;
  RestoredAfterwards& operator=(const RestoredAfterwards&) = delete;

 private:
  void tell(const char* why) const noexcept;

  device::Device& device_;
  Notice notice_;
  std::vector<device::Assignment> before_;
};

}  // namespace kmax::experiment
