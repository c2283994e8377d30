#include "host_tools/serve/real_time.hpp"

#include <algorithm>
#include <chrono>

namespace kmax::serve {

PaceReport run_in_real_time(simulated_board::SimulatedBoard& simulation, const HostSide& host,
                            const std::function<bool()>& stop) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::microseconds;
  constexpr auto tick = microseconds(board::NativeBoard<simulated_board::SimulatedDevice>::tick_us);
  constexpr auto most_behind = microseconds(50'000);
  constexpr auto rest = microseconds(500);

  auto& board = simulation.board();
  board.connect_can(host.can != nullptr);
  PaceReport report;
  auto reached = Clock::now();
  while (!stop()) {
    wait_for_host(host, rest);
    if (host.line != nullptr) {
      const auto received = host.line->read(0);
      if (!received.empty()) board.receive(received);
    }
    if (host.can != nullptr) board.receive_can(host.can->received());
    const auto now = Clock::now();
    if (now - reached > most_behind) {
      report.behind_s += std::chrono::duration<double>(now - reached - most_behind).count();
      reached = now - most_behind;
    }
    const auto ticks = std::max<std::int64_t>(0, (now - reached) / tick);
    board.advance(static_cast<std::uint64_t>(ticks));
    reached += ticks * tick;
    report.ticks += static_cast<std::uint64_t>(ticks);
    const auto reply = board.transmitted();
    if (host.line != nullptr && !reply.empty()) host.line->write(reply);
    for (const drivers::CanFrame& frame : board.transmitted_can()) host.can->send(frame);
  }
  return report;
}

}  // namespace kmax::serve
