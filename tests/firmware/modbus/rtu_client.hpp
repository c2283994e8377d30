// A Modbus client and the line to one port, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>

#include "firmware/modbus/rtu_port.hpp"
#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus {

// Sends requests and collects whole replies.
class RtuClient {
 public:
  explicit RtuClient(RtuPortConfig config = {}, std::uint32_t start_us = 0)
      : line(config.baud_rate, start_us, config.format.bits()), port(bank, config) {}

  void send(const Bytes& bytes) { line.send(port, bytes); }

  void settle() { line.silence(line.t3_5_us() + line.character_us() + 4); }

  // Fetches a reply and plays it out, with its echo if the line has two wires.
  Bytes take_reply(bool echo = false) {
    const std::span<const std::uint8_t> reply = port.reply_due(line.now());
    Bytes bytes(reply.begin(), reply.end());
    if (bytes.empty()) return bytes;
    for (const std::uint8_t byte : bytes) {
      const std::uint32_t end = line.character();
      if (echo) port.receive(byte, false, end);
      EXPECT_TRUE(port.reply_due(line.now()).empty());
    }
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), reply.begin()));
    port.reply_sent(line.now());
    return bytes;
  }

  Bytes exchange(const Bytes& request, bool echo = false) {
    send(request);
    settle();
    port.poll(line.now());
    return take_reply(echo);
  }

  bool is_alive() {
    settle();
    port.poll(line.now());
    (void)take_reply();
    settle();
    const Bytes reply = exchange(adu(port.config().unit, {4, 0, 1, 0, 1}));
    return reply == adu(port.config().unit, {4, 2, 0x80, 0x01});
  }

  InMemoryBank bank;
  RtuLine line;
  RtuPort<InMemoryBank> port;
};

}  // namespace kmax::firmware::modbus
