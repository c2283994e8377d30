#include "host_tools/device/serial/serial_port_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace kmax::device {

namespace {
[[noreturn]] void fail_to_open(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      throw LinkError(fmt::format(
          "{}: there is no such port; check the cable, and 'ls -l /dev/serial/by-id' for the ports there are",
          path));
    case EACCES:
    case EPERM:
      throw LinkError(fmt::format(
          "{}: you may not open this port; join the group that owns it (on most systems 'sudo usermod -aG "
          "dialout $USER', then log in again) or install a udev rule",
          path));
    default:
      throw LinkError(fmt::format("{}: cannot open the port: {}", path, std::strerror(error)));
  }
}

// The master half of every pseudo-terminal pair belongs to the kernel's major numbers 136..143.
bool is_pseudo_terminal(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 && major(status.st_rdev) >= 136 && major(status.st_rdev) <= 143;
}
}  // namespace

SerialPortLock::SerialPortLock(const std::string& path, const Notice& notice) : path_(path) {
  take(notice);
  pseudo_terminal_ = is_pseudo_terminal(descriptor_.number());
}

SerialPortLock::~SerialPortLock() {
  admit_others();
}

bool SerialPortLock::try_take() {
  if (!descriptor_) {
    // Non-blocking: without it the open would wait for a modem's carrier.
    base::FileDescriptor opened(open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!opened && errno == EBUSY) return false;  // its holder excludes others
    if (!opened) fail_to_open(path_, errno);
    if (isatty(opened.number()) == 0) throw LinkError(fmt::format("{}: this is not a serial port", path_));
    descriptor_ = std::move(opened);
  }
  if (flock(descriptor_.number(), LOCK_EX | LOCK_NB) != 0) return false;
  if (excluded_before_lending_) exclude_others();
  excluded_before_lending_ = false;
  return true;
}

void SerialPortLock::give_back() {
  excluded_before_lending_ = excluding_;
  admit_others();
  flock(descriptor_.number(), LOCK_UN);
}

std::string SerialPortLock::words_for_in_use() const {
  return fmt::format(
      "the port is in use by another program ('fuser -v {}' names it); end that one and try again", path_);
}

void SerialPortLock::exclude_others() {
  if (!pseudo_terminal_) excluding_ = ioctl(descriptor_.number(), TIOCEXCL) == 0;
}

void SerialPortLock::admit_others() {
  if (excluding_) ioctl(descriptor_.number(), TIOCNXCL);
  excluding_ = false;
}

}  // namespace kmax::device
