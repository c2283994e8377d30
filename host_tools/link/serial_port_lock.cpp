#include "host_tools/link/serial_port_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

namespace kmax::link {

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
          "{}: you may not open this port; join the group that owns it (on most systems 'sudo usermod "
          "-aG dialout $USER', then log in again) or install a udev rule",
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

SerialPortLock::SerialPortLock(const std::string& path, const Notice& notice) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  bool noticed = false;
  for (;;) {
    // Non-blocking: without it the open would wait for a modem's carrier.
    if (descriptor_ < 0) descriptor_ = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor_ < 0 && errno != EBUSY) fail_to_open(path, errno);
    if (descriptor_ >= 0) {
      if (isatty(descriptor_) == 0) {
        close(descriptor_);
        throw LinkError(fmt::format("{}: this is not a serial port", path));
      }
      if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) break;
    }
    const auto waited = Clock::now() - start;
    if (waited > patience) {
      if (descriptor_ >= 0) close(descriptor_);
      throw LinkError(fmt::format(
          "{}: the port is in use by another program ('fuser -v {}' names it); end that one and try again",
          path, path));
    }
    if (!noticed && notice && waited > std::chrono::milliseconds(300)) {
      notice(fmt::format("waiting for another program to release {}", path));
      noticed = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  pseudo_terminal_ = is_pseudo_terminal(descriptor_);
}

SerialPortLock::~SerialPortLock() {
  admit_others();
  close(descriptor_);
}

void SerialPortLock::lend(std::chrono::microseconds duration) {
  const bool excluded = excluding_;
  admit_others();
  flock(descriptor_, LOCK_UN);
  std::this_thread::sleep_for(duration);
  const auto start = std::chrono::steady_clock::now();
  while (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() - start > patience)
      throw LinkError("another program took the serial port and did not give it back");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  if (excluded) exclude_others();
}

void SerialPortLock::exclude_others() {
  if (!pseudo_terminal_) excluding_ = ioctl(descriptor_, TIOCEXCL) == 0;
}

void SerialPortLock::admit_others() {
  if (excluding_) ioctl(descriptor_, TIOCNXCL);
  excluding_ = false;
}

}  // namespace kmax::link
