#pragma once

#include <stdexcept>

namespace kmax::base {

/// What the user asked for cannot be meant: an unknown name, a value that is not allowed. Nothing was sent.
/// Also thrown when the device finds the same fault in values that only it can judge together.
class ValueError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// The device did not do what was asked, or is not one this program can talk to.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// This program was stopped (suspended, swapped out) for so long that it had to give up what it was doing.
/// Nothing was changed; trying again may do.
class StoodStill : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

}  // namespace kmax::base
