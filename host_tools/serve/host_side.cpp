#include "host_tools/serve/host_side.hpp"

#include <poll.h>

#include <array>
#include <ctime>

namespace kmax::serve {

void wait_for_host(const HostSide& host, std::chrono::microseconds longest) {
  std::array<pollfd, 2> descriptors{};
  nfds_t count = 0;
  if (host.line != nullptr) descriptors[count++] = {host.line->descriptor(), POLLIN, 0};
  if (host.can != nullptr) descriptors[count++] = {host.can->descriptor(), POLLIN, 0};
  const timespec time{.tv_sec = static_cast<std::time_t>(longest.count() / 1'000'000),
                      .tv_nsec = static_cast<long>(longest.count() % 1'000'000) * 1000};
  // A signal or an error ends the sleep early, which does no harm.
  static_cast<void>(ppoll(descriptors.data(), count, &time, nullptr));
}

}  // namespace kmax::serve
