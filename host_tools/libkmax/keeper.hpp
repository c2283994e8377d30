#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "host_tools/device/drive.hpp"
#include "host_tools/libkmax/shared_link.hpp"

namespace kmax::library {

/// "the force of axis 0 is off: ...", and why, of an axis that is not armed.
std::string force_is_off(std::size_t axis, const device::DriveStatus& status);

/// A thread that says for an armed axis that this process lives.
class Keeper {
 public:
  /// Asked before each sign of life: false leaves it out.
  using Alive = std::function<bool()>;
  /// Called every 5 ms.
  using Watch = std::function<void()>;

  /// `timeout`: link.timeout, s; 0: none.
  Keeper(device::Device& device, std::size_t axis, double timeout, Alive alive = {}, Watch watch = {});

  /// What took the force away, or keeps it from being kept alive; empty if nothing does.
  std::string trouble() const;

 private:
  void run(const std::stop_token& stop);
  void look();

  device::Device& device_;
  std::size_t axis_;
  std::chrono::microseconds interval_;
  Alive alive_;
  Watch watch_;
  mutable std::mutex mutex_;
  std::condition_variable_any ended_;
  std::string trouble_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace kmax::library
