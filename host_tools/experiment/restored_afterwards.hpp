#pragma once

#include <string>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::experiment {

/// The parameters that an experiment is going to change, read when this begins and put back in one
/// transaction when it ends, however it ends. The axis must be disarmed by then.
class RestoredAfterwards {
 public:
  /// `changed`: NAME=VALUE or NAME each, a name without prefix is on `axis`. Errors as Device.
  RestoredAfterwards(device::Device& device, std::size_t axis, const std::vector<std::string>& changed);
  ~RestoredAfterwards();
  RestoredAfterwards(const RestoredAfterwards&) = delete;
  RestoredAfterwards& operator=(const RestoredAfterwards&) = delete;

 private:
  device::Device& device_;
  std::vector<device::Assignment> before_;
};

}  // namespace kmax::experiment
