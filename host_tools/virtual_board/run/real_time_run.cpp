#include "host_tools/virtual_board/run/real_time_run.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include "host_tools/virtual_board/run/can_bridge.hpp"

namespace kmax::virtual_board {

namespace {

using Clock = std::chrono::steady_clock;
constexpr double most_behind_s = 0.05;
constexpr double piece_s = 0.001;
constexpr auto rest = std::chrono::microseconds(300);

BoardTime board_time(double duration_s) {
  return static_cast<BoardTime>(duration_s * static_cast<double>(units_per_second));
}

}  // namespace

PaceReport run_board(VirtualBoard& board, const serve::HostSide& host, GpioBridge* gpio, double duration_s,
                     bool free_running, const std::function<bool()>& stop) {
  PaceReport report;
  std::optional<CanBridge> can;
  if (host.can != nullptr) can.emplace(board, *host.can);
  const BoardTime begin = board.now();
  const BoardTime end = duration_s > 0.0 ? begin + board_time(duration_s) : never;
  auto reached = Clock::now();
  double due_s = 0.0;
  while (!stop() && board.now() < end) {
    if (!free_running && due_s == 0.0) serve::wait_for_host(host, rest);
    if (host.line != nullptr) {
      const auto received = host.line->read(0);
      if (!received.empty()) board.receive(received);
    }
    if (can) can->exchange();
    const bool runs = gpio == nullptr || gpio->exchange();
    if (!free_running) {
      const auto now = Clock::now();
      due_s += std::chrono::duration<double>(now - reached).count();
      if (due_s > most_behind_s) {
        report.behind_s += due_s - most_behind_s;
        due_s = most_behind_s;
      }
      reached = now;
    }
    if (!runs) {
      due_s = 0.0;
      continue;
    }
    // What is due at most, and not at once: a host waits for the answers of a board that lags behind.
    const double step_s = free_running ? piece_s : std::min(due_s, piece_s);
    board.run_until(std::min(end, board.now() + board_time(step_s)));
    if (!free_running) due_s -= step_s;
    const auto transmitted = board.transmitted();
    if (host.line != nullptr && !transmitted.empty()) host.line->write(transmitted);
  }
  report.simulated_s = seconds(board.now() - begin);
  return report;
}

}  // namespace kmax::virtual_board
