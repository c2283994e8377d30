#pragma once

#include <chrono>
#include <string>

#include "host_tools/link/link.hpp"

namespace kmax::link {

/// Exclusive use of a serial port between programs that ask for it: flock() on the port itself, so that it
/// works through any symbolic link and disappears with the process, however that ends.
///
/// It is taken before the port's settings are touched: they are shared by all who have the port open, and
/// setting them would disturb the conversation of whoever holds the lock.
///
/// On a real port TIOCEXCL is added (exclude_others()), which keeps out programs that do not lock. Not on a
/// pseudo-terminal: the mark would outlive this process as long as the other end is open.
class SerialPortLock {
 public:
  static constexpr std::chrono::milliseconds patience{2000};  ///< how long another kmax is waited for

  /// Errors: LinkError if the port is missing, is no serial port, may not be opened, or stays in use.
  SerialPortLock(const std::string& path, const Notice& notice);
  ~SerialPortLock();
  SerialPortLock(const SerialPortLock&) = delete;
  SerialPortLock& operator=(const SerialPortLock&) = delete;

  bool pseudo_terminal() const { return pseudo_terminal_; }

  void exclude_others();
  void admit_others();

  /// Lets others have the port for `duration` and takes it back: a program that keeps an axis armed must not
  /// keep out the one that stops it. Errors: LinkError if another program does not give it back.
  void lend(std::chrono::microseconds duration);

 private:
  int descriptor_ = -1;
  bool pseudo_terminal_ = false;
  bool excluding_ = false;
};

}  // namespace kmax::link
