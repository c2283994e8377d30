#include "host_tools/virtual_board/run/board_link.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/parameters/parameter_values.hpp"
#include "firmware/parameters/refusal.hpp"
#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::virtual_board {

std::chrono::microseconds BoardLink::now() const {
  return std::chrono::microseconds(static_cast<std::int64_t>(seconds(board_.now()) * 1e6));
}

void BoardLink::wait(std::chrono::microseconds duration) {
  if (duration.count() > 0) board_.run_for(static_cast<double>(duration.count()) * 1e-6);
}

std::vector<std::uint8_t> BoardLink::exchange(std::span<const std::uint8_t> request, device::Repeat repeat) {
  for (int attempt = 1; repeat == device::Repeat::if_lost && attempt < 3; ++attempt) {
    try {
      return exchange_once(request);
    } catch (const device::LinkError&) {
    }
  }
  return exchange_once(request);
}

std::vector<std::uint8_t> BoardLink::exchange_once(std::span<const std::uint8_t> request) {
  // An answer to a write repeats the first registers and their number; one to a reading has the registers,
  // and one to the question who it is says itself how long it is.
  std::size_t expected = request[1] == 16 ? 8 : 5U + 2U * request[5];
  static_cast<void>(board_.transmitted());
  board_.receive(request);
  std::vector<std::uint8_t> reply;
  // An erase of the parameters' memory stops the processor for up to 0.5 s.
  for (int tenths_of_ms = 0; tenths_of_ms < 6'000; ++tenths_of_ms) {
    board_.run_for(0.0001);
    const auto bytes = board_.transmitted();
    reply.insert(reply.end(), bytes.begin(), bytes.end());
    if (request[1] == device::identification::function) {
      const std::size_t length = device::identification::frame_length(reply);  // 0: not known yet
      expected = length == 0 ? reply.size() + 1 : length;
    }
    const bool refused = reply.size() >= 2 && (reply[1] & 0x80U) != 0;
    if (reply.size() < (refused ? 5U : expected)) continue;
    if (firmware::modbus::crc_of(reply) != 0) throw device::LinkError("the board's reply has a wrong CRC");
    board_.run_for(0.002);  // the silence between two frames is 1.75 ms
    return reply;
  }
  throw device::LinkError(fmt::format("the board does not answer within 0.6 s: {} of {} bytes; {} resets, {}",
                                      reply.size(), expected, board_.resets() - 1, board_.chip().where()));
}

void BoardLink::arm(std::size_t axis) {
  const std::uint16_t controlword =
      firmware::register_address(firmware::entry_of<"drive.controlword">(), axis);
  for (const std::uint16_t word : {std::uint16_t{0x06}, std::uint16_t{0x07}, std::uint16_t{0x0F}})
    write_register(controlword, word);
  const auto status =
      read_input(firmware::register_address(firmware::entry_of<"drive.statusword">(), axis), 1)[0];
  if (firmware::statusword::state_of(status) == firmware::DriveState::operation_enabled) return;
  const auto refusal =
      read_input(firmware::register_address(firmware::entry_of<"drive.refusal">(), axis), 1)[0];
  throw std::runtime_error(fmt::format("axis {} cannot be armed: {}", axis,
                                       firmware::to_string(static_cast<firmware::Refusal>(refusal))));
}

}  // namespace kmax::virtual_board
