#pragma once

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <utility>

namespace kmax::base {

/// An open file of the operating system, closed with its owner; -1: none.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor() { reset(); }

  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }
  void reset() {
    if (number_ >= 0) close(number_);
    number_ = -1;
  }

 private:
  int number_ = -1;
};

/// Waits for `events` (POLLIN, POLLOUT) on a descriptor, not longer than `wait`; 0 looks and returns.
/// True: they, or an error or a hang-up, are there. A signal ends the wait early with false.
inline bool wait_for(int descriptor, short events, std::chrono::microseconds wait) {
  // ppoll: poll() counts milliseconds, a good eight frames of a fast bus.
  const auto us = std::max<std::int64_t>(0, wait.count());
  const timespec time{static_cast<time_t>(us / 1'000'000), static_cast<long>(us % 1'000'000 * 1000)};
  pollfd one{descriptor, events, 0};
  return ppoll(&one, 1, &time, nullptr) > 0;
}

}  // namespace kmax::base
