#pragma once

#include <kmax/export.hpp>

#include <stdexcept>

namespace kmax {

/// What went wrong with a device, its link or a run. The message is the command line's: what happened, where,
/// what to look at.
class KMAX_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No conversation is possible: the port cannot be opened or vanished, another program has it, nobody
/// answers.
class KMAX_API LinkError : public Error {
 public:
  using Error::Error;
};

/// The device answered and did not do what was asked, or took the force away; says why.
class KMAX_API RefusedError : public Error {
 public:
  using Error::Error;
};

/// The function of a force loop did not return in time, so that the axis was disarmed.
class KMAX_API WatchdogError : public Error {
 public:
  using Error::Error;
};

/// Ctrl-C ended a command that was in progress; nothing is armed.
class KMAX_API Interrupted : public Error {
 public:
  using Error::Error;
};

/// What was asked for cannot be meant: an unknown name, a wrong unit, a value that is not allowed. Nothing
/// was changed.
class KMAX_API ValueError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

}  // namespace kmax
