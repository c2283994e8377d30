#include "host_tools/virtual_board/real_time_run.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

namespace kmax::virtual_board {

namespace {

using Clock = std::chrono::steady_clock;
constexpr double most_behind_s = 0.05;
constexpr double piece_s = 0.001;

BoardTime board_time(double duration_s) {
  return static_cast<BoardTime>(duration_s * static_cast<double>(units_per_second));
}

}  // namespace

PaceReport run_board(VirtualBoard& board, serve::PseudoTerminal* line, double duration_s, bool free_running,
                     const std::function<bool()>& stop) {
  PaceReport report;
  const BoardTime begin = board.now();
  const BoardTime end = duration_s > 0.0 ? begin + board_time(duration_s) : never;
  auto reached = Clock::now();
  while (!stop() && board.now() < end) {
    const std::int64_t wait_us = free_running ? 0 : 500;
    if (line != nullptr) {
      const auto received = line->read(wait_us);
      if (!received.empty()) board.receive(received);
    } else if (wait_us > 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(wait_us));
    }
    double due_s = piece_s;
    if (!free_running) {
      const auto now = Clock::now();
      due_s = std::chrono::duration<double>(now - reached).count();
      if (due_s > most_behind_s) {
        report.behind_s += due_s - most_behind_s;
        due_s = most_behind_s;
      }
      reached = now;
    }
    board.run_until(std::min(end, board.now() + board_time(due_s)));
    const auto transmitted = board.transmitted();
    if (line != nullptr && !transmitted.empty()) line->write(transmitted);
  }
  report.simulated_s = seconds(board.now() - begin);
  return report;
}

}  // namespace kmax::virtual_board
