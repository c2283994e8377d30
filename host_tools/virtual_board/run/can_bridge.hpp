#pragma once

#include <cstdint>

#include "host_tools/serve/can_connection.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"

namespace kmax::virtual_board {

/// The board's CAN bus, with its bits and their time, as one node among others on a bus of the host's.
///
/// Frames cross in both directions as soon as exchange() is called; on the board's side they then take their
/// time. The node has the board's bit rate: an interface whose bit rate does not match is for real hardware
/// to find. It never sends error frames of its own.
class CanBridge {
 public:
  CanBridge(VirtualBoard& board, serve::CanConnection& connection);
  CanBridge(const CanBridge&) = delete;
  CanBridge& operator=(const CanBridge&) = delete;

  /// Hands over what has come since the last call.
  void exchange();

  CanHostNode& node() { return node_; }

 private:
  VirtualBoard& board_;
  serve::CanConnection& connection_;
  CanHostNode node_;
};

}  // namespace kmax::virtual_board
