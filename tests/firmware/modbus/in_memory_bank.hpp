// A small RegisterBank for the Modbus tests, strict about what the server may ask.
//
//   holding 0x0000..0x003F  plain registers
//           0x0040..0x0047  four values of two registers each, written whole or not at all: a write range
//                           that cuts one in two gets illegal_data_address
//           0x0048          value at most 1000, else illegal_data_value
//           0x0049          read-only: illegal_data_address on write
//           0x004A          write fails: server_device_failure
//           0x004B          write refused for now: server_device_busy
//           0x0100..0x01FF  plain registers, room for the longest requests
//           0xFFF0..0xFFFF  plain registers at the end of the address space
//   input   0x0000..0x00FF  value 0x8000 + address
//           0xFFFF
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/modbus/register_bank.hpp"

namespace kmax::firmware::modbus {

class InMemoryBank {
 public:
  InMemoryBank() {
    for (const auto& [first, last] : ranges) {
      for (std::size_t address = first; address <= last; ++address) {
        holding[static_cast<std::uint16_t>(address)] = static_cast<std::uint16_t>(address ^ 0x5A00U);
      }
    }
    holding[0x0048] = 7;
  }

  Exception read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
    check_range(address, out.size(), 125);
    ++reads;
    if (!has_holding(address, static_cast<std::uint16_t>(out.size()))) return Exception::illegal_data_address;
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = holding[static_cast<std::uint16_t>(address + i)];
    return Exception::none;
  }

  Exception read_input(std::uint16_t address, std::span<std::uint16_t> out) {
    check_range(address, out.size(), 125);
    ++reads;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t register_address = address + i;
      if (register_address > 0x00FF && register_address != 0xFFFF) return Exception::illegal_data_address;
      out[i] = static_cast<std::uint16_t>(0x8000U + register_address);
    }
    return Exception::none;
  }

  Exception write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
    check_range(address, in.size(), 123);
    const std::size_t end = address + in.size();
    for (std::size_t a = address; a < end; ++a) {
      if (!is_there(a) || a == 0x0049) return Exception::illegal_data_address;
    }
    const auto cuts = [](std::size_t edge) { return edge > 0x0040 && edge < 0x0048 && edge % 2 == 1; };
    if (cuts(address) || cuts(end)) return Exception::illegal_data_address;
    for (std::size_t a = address; a < end; ++a) {
      if (a == 0x0048 && in[a - address] > 1000) return Exception::illegal_data_value;
      if (a == 0x004A) return Exception::server_device_failure;
      if (a == 0x004B) return Exception::server_device_busy;
    }
    ++writes;
    for (std::size_t i = 0; i < in.size(); ++i) holding[static_cast<std::uint16_t>(address + i)] = in[i];
    if (on_write) on_write();
    return Exception::none;
  }

  bool has_holding(std::uint16_t address, std::uint16_t count) {
    check_range(address, count, 125);
    for (std::size_t a = address; a < std::size_t{address} + count; ++a) {
      if (!is_there(a)) return false;
    }
    return true;
  }

  std::string_view identification(std::uint8_t id) {
    const auto object = objects.find(id);
    return object == objects.end() ? std::string_view{} : std::string_view{object->second};
  }

  std::map<std::uint16_t, std::uint16_t> holding;
  std::map<std::uint8_t, std::string> objects{{0, "Kmax"}, {1, "kmax-test"}, {2, "0.1.0"}};
  int reads = 0;
  int writes = 0;
  bool asked_beyond_contract = false;  // a range that the concept promises never to pass
  std::function<void()> on_write;

 private:
  static constexpr std::pair<std::size_t, std::size_t> ranges[] = {
      {0, 0x4B}, {0x100, 0x1FF}, {0xFFF0, 0xFFFF}};

  static bool is_there(std::size_t address) {
    for (const auto& [first, last] : ranges) {
      if (address >= first && address <= last) return true;
    }
    return false;
  }

  void check_range(std::size_t address, std::size_t count, std::size_t most) {
    if (count < 1 || count > most || address + count > 0x1'0000) asked_beyond_contract = true;
  }
};

static_assert(RegisterBank<InMemoryBank>);

}  // namespace kmax::firmware::modbus
