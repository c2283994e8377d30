#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// A Modbus RTU master on the board's serial line in board time, for tools that need no real time. Unit 1,
/// 115200 baud, the firmware's defaults. Throws std::runtime_error without an answer within 0.1 s, or for an
/// exception.
class ModbusMaster {
 public:
  explicit ModbusMaster(VirtualBoard& board) : board_(board) {}

  void write_register(std::uint16_t address, std::uint16_t value);
  void write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values);
  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count);
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count);

  /// Shutdown, switch on, enable operation. Throws std::runtime_error, with the reason in words, when the
  /// axis refuses.
  void arm(std::size_t axis);

 private:
  std::vector<std::uint8_t> exchange(std::vector<std::uint8_t> request, std::size_t reply_size);
  std::vector<std::uint16_t> read(std::uint8_t function, std::uint16_t address, std::uint16_t count);

  VirtualBoard& board_;
};

}  // namespace kmax::virtual_board
