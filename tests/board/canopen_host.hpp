// A host on the native board's CAN bus, message by message.
#pragma once

#include <array>
#include <vector>

#include "firmware/canopen/sdo_server.hpp"
#include "firmware/object_dictionary/cob_id.hpp"
#include "tests/board/bench.hpp"
#include "tests/firmware/fake_flash.hpp"

namespace kmax::board {

template <typename Device>
class CanOpenHostWith {
 public:
  CanOpenHostWith() {
    bench.application().attach_store(firmware::AnyFlashSectors::of(flash));
    bench.board().connect_can(true);
    run_ms(5);
  }

  void run_ms(double ms) {
    bench.run_ms(ms);
    const auto left = bench.board().transmitted_can();
    heard.insert(heard.end(), left.begin(), left.end());
  }
  void send(const drivers::CanFrame& frame, double ms = 2.0) {
    bench.board().receive_can(std::array{frame});
    run_ms(ms);
  }
  void nmt(std::uint8_t command) {
    send({.identifier = firmware::canopen::cob_id::nmt, .length = 2, .data = {command, 1}});
  }
  void heartbeat_of(std::uint8_t node) {
    send({.identifier = firmware::canopen::cob_id::heartbeat + node, .length = 1, .data = {5}});
  }
  /// Controlword and target torque of axis 0, by the first PDO as it is mapped from the factory.
  void rpdo(std::uint16_t controlword, std::int16_t torque, double ms = 2.0) {
    const auto target = static_cast<std::uint16_t>(torque);
    send({.identifier = 0x201,
          .length = 4,
          .data = {static_cast<std::uint8_t>(controlword), static_cast<std::uint8_t>(controlword >> 8),
                   static_cast<std::uint8_t>(target), static_cast<std::uint8_t>(target >> 8)}},
         ms);
  }

  /// 0, or the abort code.
  std::uint32_t write(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, unsigned bytes) {
    const auto answer =
        transfer({static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2), low(index), high(index), subindex,
                  static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
                  static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)});
    return answer[0] == 0x60 ? 0 : number_in(answer);
  }
  std::uint32_t read(std::uint16_t index, std::uint8_t subindex) {
    const auto answer = transfer({0x40, low(index), high(index), subindex});
    EXPECT_EQ(answer[0] & 0xE3, 0x43) << index;
    const unsigned unused = (answer[0] >> 2 & 3U) * 8U;
    return number_in(answer) << unused >> unused;
  }
  void command(std::uint16_t word) { EXPECT_EQ(write(0x6040, 0, word, 2), 0U); }
  bool armed() { return bench.state() == DriveState::operation_enabled; }
  firmware::Fault fault() { return bench.application().fault(0); }
  /// Axis 0 in mode torque, armed through transfers.
  void arm_torque(std::int16_t torque) {
    EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
    command(6);
    command(15);
    EXPECT_EQ(write(0x6071, 0, static_cast<std::uint16_t>(torque), 2), 0U);
    run_ms(20);
  }

  /// One request to the server that is asked, and its answer.
  std::array<std::uint8_t, 8> transfer(const std::array<std::uint8_t, 8>& request) {
    heard.clear();
    send({.identifier = server.request, .length = 8, .data = request});
    for (const drivers::CanFrame& frame : heard) {
      if (frame.identifier == server.response) return frame.data;
    }
    ADD_FAILURE() << "no answer";
    return {};
  }

  /// The one that is asked.
  firmware::canopen::SdoChannel server = firmware::canopen::SdoChannel::predefined(1);
  firmware::FakeFlash flash;
  BenchWith<Device> bench;
  std::vector<drivers::CanFrame> heard;

 private:
  static std::uint32_t number_in(const std::array<std::uint8_t, 8>& answer) {
    std::uint32_t number = 0;
    for (unsigned i = 0; i < 4; ++i) number |= std::uint32_t{answer[4 + i]} << (8 * i);
    return number;
  }
};

using CanOpenHost = CanOpenHostWith<ScriptedDevice>;

}  // namespace kmax::board
