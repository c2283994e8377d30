#include "host_tools/libkmax/open_device.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

namespace kmax::library {

bool OpenDevice::is_of_this_process() const {
  return getpid() == process_;
}

void OpenDevice::close() {
  // What a fork's child has of it are the parent's link, locks and threads that do not run there.
  if (!is_of_this_process()) {
    static_cast<void>(session_.release());
    return;
  }
  std::unique_lock lock(mutex_);
  if (!session_) return;
  if (std::ranges::find(callers_, std::this_thread::get_id()) != callers_.end())
    throw Error(
        "a device cannot be closed from within one of its own calls; let the function end that call, and "
        "close it then");
  closing_ = true;
  session_->link().end();
  const auto poll = session_->options.poll;
  while (!left_.wait_for(lock, std::chrono::milliseconds(20), [this] { return callers_.empty(); })) {
    if (!poll) continue;
    lock.unlock();
    poll();
    lock.lock();
  }
  const auto ended = std::move(session_);
  lock.unlock();
}

bool OpenDevice::is_open() const {
  if (!is_of_this_process()) return false;
  const std::lock_guard lock(mutex_);
  return session_ && !closing_;
}

OpenDevice::Call::Call(OpenDevice* device) : device_(device) {
  if (device_ != nullptr && !device_->is_of_this_process())
    throw Error(
        fmt::format("the device was opened by process {}, of which this one is a fork; open it again here, "
                    "when the other one has closed it",
                    device_->process_));
  std::unique_lock<std::mutex> lock;
  if (device_ != nullptr) lock = std::unique_lock(device_->mutex_);
  if (device_ == nullptr || !device_->session_ || device_->closing_)
    throw Error("the device is closed; open it again");
  device_->callers_.push_back(std::this_thread::get_id());
}

OpenDevice::Call::~Call() {
  const std::lock_guard lock(device_->mutex_);
  device_->callers_.erase(std::ranges::find(device_->callers_, std::this_thread::get_id()));
  device_->left_.notify_all();  // with the lock: whoever waits may destroy all of this next
}

}  // namespace kmax::library
