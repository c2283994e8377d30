// A native board with a scripted device, and a host that speaks Modbus to it: the whole firmware as its user
// sees it. Default scale in these tests: one count is 1 um, the wall at 0 with free space on the + side.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "board/native/native_board.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "tests/board/scripted_device.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/firmware/register_words.hpp"

namespace kmax::board {

using firmware::DriveState;
using firmware::Refusal;
using firmware::Words;
using firmware::modbus::Bytes;
using firmware::modbus::high;
using firmware::modbus::low;

template <typename Device>
class BenchWith {
 public:
  BenchWith() : board_(std::make_unique<NativeBoard<Device>>(device)) {}

  NativeBoard<Device>& board() { return *board_; }
  firmware::Application& application() { return board_->application(); }

  void run_ticks(std::uint64_t ticks) { board_->advance(ticks); }
  void run_ms(double ms) { board_->advance(static_cast<std::uint64_t>(ms * 20.0 + 0.5)); }

  /// Sends a request and waits for its whole reply; empty if none comes within 100 ms.
  Bytes request(const Bytes& pdu, std::uint8_t to_unit = 1) {
    (void)board_->transmitted();
    board_->receive(firmware::modbus::adu(to_unit, pdu));
    for (int i = 0; i < 2000; ++i) {
      board_->advance(1);
      Bytes reply = board_->transmitted();
      if (reply.empty()) continue;
      EXPECT_EQ(firmware::modbus::reference_crc(reply), 0);
      EXPECT_EQ(reply.front(), to_unit);
      return Bytes(reply.begin() + 1, reply.end() - 2);
    }
    return {};
  }

  /// 0: written; else the Modbus exception.
  int write(std::uint16_t address, const Words& words) {
    return exception_of(request(firmware::modbus::multiple_request(address, words)));
  }
  int set(std::string_view name, double number, std::size_t axis = 0) {
    return write(firmware::address_of(name, axis), firmware::words_for(name, number));
  }

  Words read(std::uint8_t function, std::uint16_t address, std::uint8_t count) {
    const Bytes reply = request({function, high(address), low(address), 0, count});
    Words words;
    if (exception_of(reply) != 0) return words;
    for (std::size_t i = 2; i + 1 < reply.size(); i += 2)
      words.push_back(static_cast<std::uint16_t>(reply[i] << 8 | reply[i + 1]));
    return words;
  }
  double get(std::string_view name, std::size_t axis = 0) {
    const firmware::Entry& entry = firmware::entry_at(firmware::entry_named(name));
    const std::uint8_t function = entry.access == firmware::Access::read_write ? 3 : 4;
    const Words words = read(function, firmware::address_of(name, axis),
                             static_cast<std::uint8_t>(firmware::register_count(entry.type)));
    if (words.empty()) {
      ADD_FAILURE() << "no value for " << name;
      return -12345;
    }
    return firmware::number_in(name, words);
  }

  int command(std::uint16_t word, std::size_t axis = 0) {
    return write(firmware::address_of("drive.controlword", axis), {word});
  }
  DriveState state(std::size_t axis = 0) { return application().state(axis); }
  Refusal refusal(std::size_t axis = 0) {
    return static_cast<Refusal>(static_cast<int>(get("drive.refusal", axis)));
  }
  /// As a host arms: shutdown, enable operation.
  bool arm(std::size_t axis = 0) {
    command(0x06, axis);
    command(0x0F, axis);
    run_ticks(3);
    return state(axis) == DriveState::operation_enabled;
  }
  void disarm(std::size_t axis = 0) { command(0x06, axis); }
  void clear_fault(std::size_t axis = 0) {
    command(0x00, axis);
    command(0x80, axis);
  }

  /// A scale of 1 um per count, no soft start, no speed trip, no supervision, a spring of 1000 N/m.
  void set_up_plain_wall(std::size_t axis = 0) {
    preset("encoder.counts_per_turn", 1'000'000, axis);
    preset("device.transmission", 0.15915494309189535, axis);
    preset("force.ramp_time", 0, axis);
    preset("velocity.limit", 0, axis);
    preset("link.timeout", 0, 0);
  }
  void preset(std::string_view name, double number, std::size_t axis = 0) {
    const std::size_t entry = firmware::entry_named(name);
    const auto raw = firmware::raw_from_number(firmware::entry_at(entry).type, number);
    EXPECT_EQ(application().preset(entry, axis, raw).refusal, Refusal::none) << name;
  }

  float force(std::size_t axis = 0) const { return device.last[axis].force; }

  Device device;

  static int exception_of(const Bytes& reply) {
    if (reply.size() < 2) return -1;
    return (reply[0] & 0x80) != 0 ? reply[1] : 0;
  }

 private:
  std::unique_ptr<NativeBoard<Device>> board_;
};

using Bench = BenchWith<ScriptedDevice>;

/// Every axis outside a plain wall of its own.
class BenchOfWalls : public testing::Test {
 protected:
  BenchOfWalls() {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      bench.set_up_plain_wall(axis);
      bench.device.stand_at(1000, axis);
    }
    bench.run_ticks(20);
  }
  Bench bench;
};

}  // namespace kmax::board
