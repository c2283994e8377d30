#pragma once

#include <string>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/exclusive_use.hpp"

namespace kmax::device {

/// Exclusive use of a serial port between programs that ask for it: flock() on the port itself, so that it
/// works through any symbolic link and disappears with the process, however that ends.
///
/// It is taken before the port's settings are touched: they are shared by all who have the port open, and
/// setting them would disturb the conversation of whoever holds the lock.
///
/// On a real port TIOCEXCL is added (exclude_others()), which keeps out programs that do not lock. Not on a
/// pseudo-terminal: the mark would outlive this process as long as the other end is open.
class SerialPortLock final : public ExclusiveUse {
 public:
  /// Errors: LinkError if the port is missing, is no serial port, may not be opened, or stays in use.
  SerialPortLock(const std::string& path, const Notice& notice);
  ~SerialPortLock() override;

  bool pseudo_terminal() const { return pseudo_terminal_; }

  void exclude_others();
  void admit_others();

 private:
  bool try_take() override;
  void give_back() override;
  std::string name() const override { return path_; }
  std::string words_for_in_use() const override;

  std::string path_;
  base::FileDescriptor descriptor_;
  bool pseudo_terminal_ = false;
  bool excluding_ = false;
  bool excluded_before_lending_ = false;
};

}  // namespace kmax::device
