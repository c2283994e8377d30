#include "host_tools/virtual_board/run/can_bridge.hpp"

namespace kmax::virtual_board {

namespace {
constexpr std::size_t most_waiting = 64;
}  // namespace

CanBridge::CanBridge(VirtualBoard& board, serve::CanConnection& connection)
    : board_(board), connection_(connection), node_(board.can_bus(), 1'000'000) {
  node_.on_frame([this](const drivers::CanFrame& frame, BoardTime) { connection_.send(frame); });
}

void CanBridge::exchange() {
  if (const BoardTime bit_time = board_.can_node().bit_time(); bit_time != 0)
    node_.set_bit_time(bit_time, board_.now());
  // What the bus cannot take waits with the host, whose own queue is bounded.
  if (node_.waiting() >= most_waiting) return;
  for (const drivers::CanFrame& frame : connection_.received()) node_.send(frame, board_.now());
}

}  // namespace kmax::virtual_board
