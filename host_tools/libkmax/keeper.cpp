#include "host_tools/libkmax/keeper.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kmax::library {

using std::chrono::microseconds;
using std::chrono::milliseconds;

std::string force_is_off(std::size_t axis, const device::DriveStatus& status) {
  return fmt::format("the force of axis {} is off: {}", axis,
                     status.faulty() ? status.fault_words() : std::string(device::to_string(status.state())));
}

Keeper::Keeper(device::Device& device, std::size_t axis, double timeout, Alive alive, Watch watch)
    : device_(device),
      axis_(axis),
      interval_(std::clamp(timeout > 0 ? microseconds(static_cast<std::int64_t>(timeout * 250e3))
                                       : microseconds(milliseconds(200)),
                           microseconds(milliseconds(10)), microseconds(milliseconds(200)))),
      alive_(std::move(alive)),
      watch_(std::move(watch)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::string Keeper::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void Keeper::run(const std::stop_token& stop) {
  const Uninterrupted uninterrupted;
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    try {
      if (watch_) watch_();
      if (std::chrono::steady_clock::now() >= next && (!alive_ || alive_())) {
        next = std::chrono::steady_clock::now() + interval_;
        look();
      }
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      trouble_ = error.what();
    }
    std::unique_lock lock(mutex_);
    // A watch has to go on, whatever became of the rest.
    if (!trouble_.empty() && !watch_) return;
    ended_.wait_for(lock, stop, milliseconds(5), [] { return false; });
  }
}

/// Reading is a sign of life too: device::Link's implementations see to that.
void Keeper::look() {
  const device::DriveStatus status = device::Drive(device_, axis_).status();
  if (status.armed()) return;
  const std::lock_guard lock(mutex_);
  if (!trouble_.empty()) return;
  trouble_ = force_is_off(axis_, status);
}

}  // namespace kmax::library
