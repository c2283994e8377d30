#include "host_tools/virtual_board/run/modbus_master.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/parameters/parameter_values.hpp"
#include "firmware/parameters/refusal.hpp"

namespace kmax::virtual_board {

std::vector<std::uint8_t> ModbusMaster::exchange(std::vector<std::uint8_t> request, std::size_t reply_size) {
  const std::uint16_t crc = firmware::modbus::crc_of(request);
  request.push_back(static_cast<std::uint8_t>(crc));
  request.push_back(static_cast<std::uint8_t>(crc >> 8));
  static_cast<void>(board_.transmitted());
  board_.receive(request);
  std::vector<std::uint8_t> reply;
  for (int ms = 0; ms < 100; ++ms) {
    board_.run_for(0.001);
    const auto bytes = board_.transmitted();
    reply.insert(reply.end(), bytes.begin(), bytes.end());
    const bool exception = reply.size() >= 2 && (reply[1] & 0x80U) != 0;
    if (exception && reply.size() >= 5)
      throw std::runtime_error(
          fmt::format("the board answers function {} with exception {}", request[1], reply[2]));
    if (!exception && reply.size() >= reply_size) {
      board_.run_for(0.003);  // the silence after a frame
      return reply;
    }
  }
  throw std::runtime_error(fmt::format(
      "at {:.3f} s the board does not answer function {}: {} of {} bytes; {} resets, {}",
      seconds(board_.now()), request[1], reply.size(), reply_size, board_.resets() - 1, board_.where()));
}

void ModbusMaster::write_register(std::uint16_t address, std::uint16_t value) {
  static_cast<void>(
      exchange({1, 6, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address),
                static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)},
               8));
}

void ModbusMaster::write_registers(std::uint16_t address, const std::vector<std::uint16_t>& values) {
  std::vector<std::uint8_t> request{1,
                                    16,
                                    static_cast<std::uint8_t>(address >> 8),
                                    static_cast<std::uint8_t>(address),
                                    static_cast<std::uint8_t>(values.size() >> 8),
                                    static_cast<std::uint8_t>(values.size()),
                                    static_cast<std::uint8_t>(2 * values.size())};
  for (const std::uint16_t value : values) {
    request.push_back(static_cast<std::uint8_t>(value >> 8));
    request.push_back(static_cast<std::uint8_t>(value));
  }
  static_cast<void>(exchange(std::move(request), 8));
}

std::vector<std::uint16_t> ModbusMaster::read(std::uint8_t function, std::uint16_t address,
                                              std::uint16_t count) {
  const auto reply =
      exchange({1, function, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address),
                static_cast<std::uint8_t>(count >> 8), static_cast<std::uint8_t>(count)},
               5U + 2U * count);
  std::vector<std::uint16_t> words;
  for (std::size_t i = 0; i < count; ++i)
    words.push_back(static_cast<std::uint16_t>(reply[3 + 2 * i] << 8 | reply[4 + 2 * i]));
  return words;
}

std::vector<std::uint16_t> ModbusMaster::read_holding(std::uint16_t address, std::uint16_t count) {
  return read(3, address, count);
}

std::vector<std::uint16_t> ModbusMaster::read_input(std::uint16_t address, std::uint16_t count) {
  return read(4, address, count);
}

void ModbusMaster::arm(std::size_t axis) {
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
