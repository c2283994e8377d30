#include "host_tools/virtual_board/run/real_time_run.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"

namespace kmax::virtual_board {

namespace {

using Clock = std::chrono::steady_clock;
constexpr serve::Pace::Time piece = std::chrono::milliseconds(1);
constexpr auto rest = std::chrono::microseconds(300);

BoardTime board_time(std::chrono::duration<double> duration) {
  return static_cast<BoardTime>(duration.count() * static_cast<double>(units_per_second));
}

/// The board's CAN bus, with its bits and their time, as one node among others on a bus of the host's.
///
/// Frames cross in both directions as soon as exchange() is called; on the board's side they then take their
/// time. The node has the board's bit rate: an interface whose bit rate does not match is for real hardware
/// to find. It never sends error frames of its own.
class CanBridge {
 public:
  CanBridge(VirtualBoard& board, serve::CanConnection& connection)
      : board_(board), connection_(connection), node_(board.can_bus(), 1'000'000) {
    node_.on_frame([this](const drivers::CanFrame& frame, BoardTime) { connection_.send(frame); });
  }
  CanBridge(const CanBridge&) = delete;
  CanBridge& operator=(const CanBridge&) = delete;

  /// Hands over what has come since the last call.
  void exchange() {
    constexpr std::size_t most_waiting = 64;
    if (const BoardTime bit_time = board_.chip().peripherals().can1.node()->bit_time(); bit_time != 0)
      node_.set_bit_time(bit_time, board_.now());
    // What the bus cannot take waits with the host, whose own queue is bounded.
    if (node_.waiting() >= most_waiting) return;
    for (const drivers::CanFrame& frame : connection_.received()) node_.send(frame, board_.now());
  }

 private:
  VirtualBoard& board_;
  serve::CanConnection& connection_;
  CanHostNode node_;
};

}  // namespace

double run_board(VirtualBoard& board, const serve::HostSide& host, GpioBridge* gpio, BenchPipe* bench,
                 UsbipServer* usb, double duration_s, serve::Pace* pace, const std::function<bool()>& stop) {
  std::optional<CanBridge> can;
  if (host.can != nullptr) can.emplace(board, *host.can);
  const BoardTime begin = board.now();
  const BoardTime end =
      duration_s > 0.0 ? begin + board_time(std::chrono::duration<double>(duration_s)) : never;
  auto reached = Clock::now();
  while (!stop() && board.now() < end) {
    if (pace != nullptr && pace->due() == serve::Pace::Time{}) serve::wait_for_host(host, rest);
    if (host.line != nullptr) {
      const auto received = host.line->read(0);
      if (!received.empty()) board.receive(received);
    }
    if (can) can->exchange();
    if (bench != nullptr) bench->exchange();
    if (usb != nullptr) usb->exchange();
    const bool runs = gpio == nullptr || gpio->exchange();
    if (pace != nullptr) {
      const auto now = Clock::now();
      pace->passed(now - reached);
      reached = now;
    }
    if (!runs) {
      if (pace != nullptr) pace->hold();
      continue;
    }
    // What is due at most, and not at once: a host waits for the answers of a board that lags behind.
    const auto step = pace != nullptr ? std::min(pace->due(), piece) : piece;
    board.run_until(std::min(end, board.now() + board_time(step)));
    if (pace != nullptr) pace->ran(step);
    const auto transmitted = board.transmitted();
    if (host.line != nullptr && !transmitted.empty()) host.line->write(transmitted);
  }
  return seconds(board.now() - begin);
}

}  // namespace kmax::virtual_board
