#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "host_tools/libkmax/session.hpp"

namespace kmax::library {

/// A session that ends when none of its calls runs any more.
class OpenDevice {
 public:
  class Call;

  OpenDevice(const device::DeviceAddress& address, DeviceOptions options)
      : session_(std::make_unique<Session>(address, std::move(options))), process_(session_->process) {}

  /// Ends the calls of other threads, which throw Error, and waits for them. Again does nothing; in a fork's
  /// child it forgets the parent's session. Error in the function of one of the device's own calls, which
  /// could not go on.
  void close();
  bool is_open() const;

 private:
  bool is_of_this_process() const;

  mutable std::mutex mutex_;
  std::condition_variable left_;
  std::unique_ptr<Session> session_;
  const pid_t process_;
  bool closing_ = false;
  std::vector<std::thread::id> callers_;  ///< one for each call that runs
};

/// Keeps the session while it exists.
class OpenDevice::Call {
 public:
  /// Errors: Error if there is no device, or it is closed or another process's.
  explicit Call(OpenDevice* device);
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  Session& session() const { return *device_->session_; }

 private:
  OpenDevice* device_;
};

}  // namespace kmax::library
