#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "firmware/modbus/crc.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::tests {

/// What host tools say to the image: Modbus RTU on the virtual board's serial line, in board time. A reading
/// that gets lost (a tick is longer than a character at high rates) is asked for again, as the serial link
/// does.
class BoardLink final : public link::FrameLink {
 public:
  explicit BoardLink(virtual_board::VirtualBoard& board) : FrameLink(1), board_(board) {}

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    return again_if_lost([&] { return FrameLink::read_holding(address, count); });
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    return again_if_lost([&] { return FrameLink::read_input(address, count); });
  }
  void write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) override {
    again_if_lost([&] {
      write_holding(address, values);
      return 0;
    });
  }
  std::chrono::microseconds now() const override {
    return std::chrono::microseconds(static_cast<std::int64_t>(virtual_board::seconds(board_.now()) * 1e6));
  }
  void wait(std::chrono::microseconds duration) override {
    if (duration.count() > 0) board_.run_for(static_cast<double>(duration.count()) * 1e-6);
  }
  std::string description() const override { return "the virtual board"; }

 private:
  template <typename Exchange>
  static std::invoke_result_t<Exchange> again_if_lost(Exchange ask) {
    for (int attempt = 1; attempt < 3; ++attempt) {
      try {
        return ask();
      } catch (const link::LinkError&) {
      }
    }
    return ask();
  }

  std::vector<std::uint8_t> exchange(std::span<const std::uint8_t> request) override {
    // An answer to a write repeats the first registers and their number; one to a reading has the registers.
    const std::size_t expected = request[1] == 16 ? 8 : 5U + 2U * request[5];
    static_cast<void>(board_.transmitted());
    board_.receive(request);
    std::vector<std::uint8_t> reply;
    // An erase of the parameters' memory stops the processor for up to 0.5 s.
    for (int tenths_of_ms = 0; tenths_of_ms < 6'000; ++tenths_of_ms) {
      board_.run_for(0.0001);
      const auto bytes = board_.transmitted();
      reply.insert(reply.end(), bytes.begin(), bytes.end());
      const bool refused = reply.size() >= 2 && (reply[1] & 0x80U) != 0;
      if (reply.size() < (refused ? 5U : expected)) continue;
      if (firmware::modbus::crc_of(reply) != 0) throw link::LinkError("the board's reply has a wrong CRC");
      board_.run_for(0.002);  // the silence between two frames is 1.75 ms
      return reply;
    }
    throw link::LinkError("the board does not answer within 0.6 s");
  }

  virtual_board::VirtualBoard& board_;
};

}  // namespace kmax::tests
