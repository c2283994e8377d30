#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// What host tools say to the image: Modbus RTU on the virtual board's serial line, in board time. Unit 1. A
/// reading that gets lost (a tick is longer than a character at high rates) is asked for again, as the serial
/// link does. Errors: device::LinkError without an answer within 0.6 s, device::RegisterRefused.
class BoardLink final : public device::FrameLink {
 public:
  explicit BoardLink(VirtualBoard& board) : FrameLink(1), board_(board) {}

  void write_register(std::uint16_t address, std::uint16_t value) { write_holding(address, {&value, 1}); }
  std::chrono::microseconds now() const override;
  void wait(std::chrono::microseconds duration) override;
  std::string description() const override { return "the virtual board"; }

  /// Shutdown, switch on, enable operation. Throws std::runtime_error, with the reason in words, when the
  /// axis refuses.
  void arm(std::size_t axis);

 private:
  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> request, device::Repeat repeat) override;
  std::vector<std::uint8_t> exchange_once(std::span<const std::uint8_t> request);

  VirtualBoard& board_;
};

}  // namespace kmax::virtual_board
