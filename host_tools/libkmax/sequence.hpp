#pragma once

#include <atomic>
#include <mutex>
#include <thread>

#include "host_tools/libkmax/shared_link.hpp"

namespace kmax::library {

/// Of one thread at a time: what takes several requests that must not mix.
class Sequence {
 public:
  class Hold;

 private:
  std::timed_mutex mutex_;
  std::atomic<std::thread::id> owner_;
};

/// From construction to destruction the sequence is this thread's.
class Sequence::Hold {
 public:
  /// Waits for another thread's, and meanwhile asks SharedLink::poll() whether to. Errors: what that throws;
  /// base::DeviceError if it is this thread's already, which would wait for itself.
  Hold(Sequence& sequence, const SharedLink& link);
  ~Hold();
  Hold(const Hold&) = delete;
  Hold& operator=(const Hold&) = delete;

 private:
  Sequence& sequence_;
};

}  // namespace kmax::library
