#pragma once

#include "host_tools/device/errors.hpp"

namespace kmax::device {

/// This program was stopped (suspended, swapped out) for so long that it had to give up what it was doing.
/// Nothing was changed; trying again may do.
class StoodStill : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

}  // namespace kmax::device
