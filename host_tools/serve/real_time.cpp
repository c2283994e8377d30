#include "host_tools/serve/real_time.hpp"

#include <poll.h>
#include <array>
#include <chrono>
#include <ctime>

namespace kmax::serve {

std::uint64_t run_in_real_time(simulated_board::SimulatedBoard& simulation, const HostSide& host, Pace& pace,
                               const std::function<bool()>& stop) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::microseconds;
  constexpr auto tick = microseconds(board::NativeBoard<simulated_board::SimulatedDevice>::tick_us);
  constexpr auto rest = microseconds(500);

  auto& board = simulation.board();
  board.connect_can(host.can != nullptr);
  std::uint64_t run = 0;
  auto reached = Clock::now();
  while (!stop()) {
    wait_for_host(host, rest);
    if (host.line != nullptr) {
      const auto received = host.line->read(0);
      if (!received.empty()) board.receive(received);
    }
    if (host.can != nullptr) board.receive_can(host.can->received());
    const auto now = Clock::now();
    pace.passed(now - reached);
    reached = now;
    const auto ticks = pace.due() / tick;
    board.advance(static_cast<std::uint64_t>(ticks));
    pace.ran(ticks * tick);
    run += static_cast<std::uint64_t>(ticks);
    const auto reply = board.transmitted();
    if (host.line != nullptr && !reply.empty()) host.line->write(reply);
    for (const drivers::CanFrame& frame : board.transmitted_can()) host.can->send(frame);
  }
  return run;
}

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
