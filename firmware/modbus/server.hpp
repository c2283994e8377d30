// Modbus request PDU in, response PDU out, over a RegisterBank (MODBUS Application Protocol V1.1b3, 6).
//
//   function                       request PDU  quantity               response
//   3   read holding registers     5            1..125                 byte count, values
//   4   read input registers       5            1..125                 byte count, values
//   6   write single register      5            -                      the request
//   8   diagnostics                3 + n        -                      see diagnostics.hpp
//   16  write multiple registers   6 + 2n       1..123                 address, quantity
//   22  mask write register        7            -                      the request
//   23  read/write multiple        10 + 2n      read 1..125, write 1..121   byte count, values
//   43  read device identification 4            -                      see device_identification.hpp
//   65  tagged request             3 + request  read and write 1..121  tag, response
//
// A response of functions 3, 4 and 23 says neither what was asked nor when: one that comes late, twice or out
// of order passes for the answer to another request of the same length. Function 65, of the range that the
// standard leaves to users, is two bytes of the client's choice and any other request; its response has the
// same two bytes before the other's response, be that an exception.
//
// Checks, in this order, the first that fails decides:
//   function known, MEI type of 43, no 65 within 65             else exception 1
//   PDU length exact, quantity, byte count = 2 x quantity       else exception 3
//   (that of 65 is at least 4)
//   address + quantity <= 65536, registers there (the bank)     else exception 2
//   execution (the bank)                                        3, 4 or 6 as the bank says
// An exception means that nothing was written: write_holding() is whole or nothing, and 23 makes sure that
// its read range exists before it writes. 23 writes first, then reads. 22 writes (current AND and_mask) OR
// (or_mask AND NOT and_mask).
//
// Functions 0 and 128..255, which no client may use, get exception 1 like any unknown one.
// Stateless but for the counters. Cost: bounded by 125 registers; about 300 bytes of stack.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/modbus/device_identification.hpp"
#include "firmware/modbus/diagnostics.hpp"
#include "firmware/modbus/register_bank.hpp"

namespace kmax::firmware::modbus {

enum class Function : std::uint8_t {
  read_holding_registers = 3,
  read_input_registers = 4,
  write_single_register = 6,
  diagnostics = 8,
  write_multiple_registers = 16,
  mask_write_register = 22,
  read_write_multiple_registers = 23,
  encapsulated_interface = 43,
  tagged_request = 65,
};

inline constexpr std::size_t tag_size = 2;

// What the request in these bytes asks for: that of a tagged one is within.
[[nodiscard]] constexpr std::span<const std::uint8_t> untagged(std::span<const std::uint8_t> pdu) {
  const bool tagged = !pdu.empty() && static_cast<Function>(pdu[0]) == Function::tagged_request;
  return tagged && pdu.size() > 1 + tag_size ? pdu.subspan(1 + tag_size) : pdu;
}

// The functions that change registers.
[[nodiscard]] constexpr bool is_write(std::uint8_t function) {
  switch (static_cast<Function>(function)) {
    case Function::write_single_register:
    case Function::write_multiple_registers:
    case Function::mask_write_register:
    case Function::read_write_multiple_registers:
      return true;
    default:
      return false;
  }
}

template <RegisterBank Bank>
class Server {
 public:
  static constexpr std::size_t read_quantity_max = 125;
  static constexpr std::size_t write_quantity_max = 123;
  static constexpr std::size_t read_write_quantity_max = 121;  // of the write part

  explicit Server(Bank& bank) : bank_(&bank) {}

  [[nodiscard]] Diagnostics& diagnostics() { return diagnostics_; }

  // Executes one request and returns the length of the response, which is at least 2; an empty request gets
  // none (0). `request` and `response` must not overlap.
  [[nodiscard]] std::size_t process(std::span<const std::uint8_t> request,
                                    std::span<std::uint8_t, pdu_size_max> response) {
    return answer(request, response);
  }

 private:
  using Request = std::span<const std::uint8_t>;
  using Response = std::span<std::uint8_t>;  // up to pdu_size_max
  using Registers = std::array<std::uint16_t, read_quantity_max>;

  std::size_t answer(Request request, Response response) {
    if (request.empty()) return 0;
    response[0] = request[0];
    std::size_t length = 0;
    const Exception exception = execute(request, response, length);
    if (exception == Exception::none) return length;
    response[0] = request[0] | 0x80U;
    response[1] = static_cast<std::uint8_t>(exception);
    return 2;
  }

  Exception execute(Request request, Response response, std::size_t& length) {
    switch (static_cast<Function>(request[0])) {
      case Function::read_holding_registers:
      case Function::read_input_registers:
        return read(request, response, length);
      case Function::write_single_register:
        return write_single(request, response, length);
      case Function::write_multiple_registers:
        return write_multiple(request, response, length);
      case Function::mask_write_register:
        return mask_write(request, response, length);
      case Function::read_write_multiple_registers:
        return read_write(request, response, length);
      case Function::encapsulated_interface:
        return DeviceIdentification<Bank>(*bank_, response.size()).read(request, response, length);
      case Function::diagnostics:
        return diagnostics_.answer(request, response, length);
      case Function::tagged_request:
        // Within another one there is less room.
        return response.size() == pdu_size_max ? tagged(request, response, length)
                                               : Exception::illegal_function;
    }
    return Exception::illegal_function;
  }

  Exception tagged(Request request, Response response, std::size_t& length) {
    constexpr std::size_t header = 1 + tag_size;
    if (request.size() <= header) return Exception::illegal_data_value;
    static_cast<void>(put_copy(request.first(header), response));
    length = header + answer(request.subspan(header), response.subspan(header));
    return Exception::none;
  }

  Exception read(Request request, Response response, std::size_t& length) {
    if (request.size() != 5) return Exception::illegal_data_value;
    const std::uint16_t address = word(request, 1);
    const std::uint16_t quantity = word(request, 3);
    if (!within(quantity, room_in(response))) return Exception::illegal_data_value;
    if (!addressable(address, quantity)) return Exception::illegal_data_address;
    Registers registers{};
    const auto values = std::span(registers).first(quantity);
    const bool holding = static_cast<Function>(request[0]) == Function::read_holding_registers;
    const Exception exception =
        holding ? bank_->read_holding(address, values) : bank_->read_input(address, values);
    if (exception == Exception::none) length = put_values(values, response);
    return exception;
  }

  Exception write_single(Request request, Response response, std::size_t& length) {
    if (request.size() != 5) return Exception::illegal_data_value;
    const Exception exception = write_one(word(request, 1), word(request, 3));
    if (exception == Exception::none) length = put_copy(request, response);
    return exception;
  }

  Exception write_multiple(Request request, Response response, std::size_t& length) {
    if (request.size() < 6) return Exception::illegal_data_value;
    const std::uint16_t address = word(request, 1);
    const std::uint16_t quantity = word(request, 3);
    if (!within(quantity, write_quantity_max)) return Exception::illegal_data_value;
    if (!carries(request, 5, quantity)) return Exception::illegal_data_value;
    if (!addressable(address, quantity)) return Exception::illegal_data_address;
    Registers registers{};
    const Exception exception = bank_->write_holding(address, get_values(request.subspan(6), registers));
    if (exception == Exception::none) length = put_copy(request.first(5), response);
    return exception;
  }

  Exception mask_write(Request request, Response response, std::size_t& length) {
    if (request.size() != 7) return Exception::illegal_data_value;
    const std::uint16_t address = word(request, 1);
    const unsigned and_mask = word(request, 3);
    const unsigned or_mask = word(request, 5);
    std::array<std::uint16_t, 1> current{};
    Exception exception = bank_->read_holding(address, std::span<std::uint16_t>(current));
    if (exception != Exception::none) return exception;
    const unsigned combined = (current[0] & and_mask) | (or_mask & ~and_mask);
    exception = write_one(address, static_cast<std::uint16_t>(combined));
    if (exception == Exception::none) length = put_copy(request, response);
    return exception;
  }

  Exception read_write(Request request, Response response, std::size_t& length) {
    if (request.size() < 10) return Exception::illegal_data_value;
    const std::uint16_t read_address = word(request, 1);
    const std::uint16_t read_quantity = word(request, 3);
    const std::uint16_t write_address = word(request, 5);
    const std::uint16_t write_quantity = word(request, 7);
    if (!within(read_quantity, room_in(response))) return Exception::illegal_data_value;
    if (!within(write_quantity, read_write_quantity_max)) return Exception::illegal_data_value;
    if (!carries(request, 9, write_quantity)) return Exception::illegal_data_value;
    if (!addressable(read_address, read_quantity) || !addressable(write_address, write_quantity) ||
        !bank_->has_holding(read_address, read_quantity)) {
      return Exception::illegal_data_address;
    }
    Registers registers{};
    Exception exception = bank_->write_holding(write_address, get_values(request.subspan(10), registers));
    if (exception != Exception::none) return exception;
    const auto values = std::span(registers).first(read_quantity);
    exception = bank_->read_holding(read_address, values);
    if (exception == Exception::none) length = put_values(values, response);
    return exception;
  }

  Exception write_one(std::uint16_t address, std::uint16_t value) {
    const std::array<std::uint16_t, 1> values{value};
    return bank_->write_holding(address, std::span<const std::uint16_t>(values));
  }

  // Registers that fit behind function and byte count: read_quantity_max, a few less in a tagged response.
  static constexpr std::size_t room_in(Response response) { return (response.size() - 2) / 2; }

  static constexpr bool within(std::uint16_t quantity, std::size_t most) {
    return quantity >= 1 && quantity <= most;
  }

  // In 32 bits: 0xFFFF + 2 is past the end, not register 1.
  static constexpr bool addressable(std::uint16_t address, std::uint16_t quantity) {
    return std::uint32_t{address} + quantity <= 0x1'0000U;
  }

  // The byte count at `position` is twice the quantity, and exactly so many bytes follow it.
  static constexpr bool carries(Request request, std::size_t position, std::uint16_t quantity) {
    const std::size_t bytes = request[position];
    return bytes == std::size_t{2} * quantity && request.size() == position + 1 + bytes;
  }

  static constexpr std::uint16_t word(Request bytes, std::size_t position) {
    return static_cast<std::uint16_t>((bytes[position] << 8U) | bytes[position + 1]);
  }

  static std::span<const std::uint16_t> get_values(Request data, Registers& registers) {
    const std::size_t count = data.size() / 2;
    for (std::size_t i = 0; i < count; ++i) registers[i] = word(data, 2 * i);
    return std::span<const std::uint16_t>(registers).first(count);
  }

  static std::size_t put_values(std::span<const std::uint16_t> values, Response response) {
    response[1] = static_cast<std::uint8_t>(2 * values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      response[2 + 2 * i] = static_cast<std::uint8_t>(values[i] >> 8U);
      response[3 + 2 * i] = static_cast<std::uint8_t>(values[i] & 0xFFU);
    }
    return 2 + 2 * values.size();
  }

  static std::size_t put_copy(Request bytes, Response response) {
    for (std::size_t i = 0; i < bytes.size(); ++i) response[i] = bytes[i];
    return bytes.size();
  }

  Bank* bank_;
  Diagnostics diagnostics_;
};

}  // namespace kmax::firmware::modbus
