#pragma once

#include <cstdint>
#include <string>

#include "host_tools/device/device.hpp"

namespace kmax::device {

/// lock.state.
enum class LockState : std::uint8_t { no_code = 0, open = 1, locked = 2 };

struct LockStatus {
  LockState state{};
  std::uint32_t attempts = 0;  ///< wrong codes since the right one was given
  std::uint32_t wait_s = 0;    ///< so long no code is taken
};

/// "locked; 2 wrong codes were given"
std::string lock_words(const LockStatus& status);

/// The device's write lock (firmware/command/write_lock.hpp). No message of an error holds a code.
///
/// If an answer is lost, the device's own state tells whether the request was carried out.
/// Errors: DeviceError with the reason in words, device::LinkError.
class Lock {
 public:
  static constexpr std::uint32_t no_code = 0;

  explicit Lock(Device& device) : device_(device) {}

  LockStatus status();

  /// Sets or changes the code, or removes it (no_code), and waits until the device has kept that: it is
  /// locked then, or has no code.
  void set_code(std::uint32_t code);
  /// Until the next start or close().
  void open(std::uint32_t code);
  void close();

 private:
  void write(const Parameter& parameter, std::uint32_t value, LockState wanted, const char* what);

  Device& device_;
};

}  // namespace kmax::device
