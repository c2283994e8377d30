#include "host_tools/device/can/descriptor_wait.hpp"

#include <poll.h>

#include <algorithm>
#include <ctime>

namespace kmax::link {

bool wait_for(int descriptor, short events, std::chrono::microseconds wait) {
  // ppoll: poll() counts milliseconds, a good eight frames of a fast bus.
  const auto us = std::max<std::int64_t>(0, wait.count());
  const timespec time{static_cast<time_t>(us / 1'000'000), static_cast<long>(us % 1'000'000 * 1000)};
  pollfd one{descriptor, events, 0};
  return ppoll(&one, 1, &time, nullptr) > 0;
}

}  // namespace kmax::link
