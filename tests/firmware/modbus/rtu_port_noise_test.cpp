// RtuPort under damaged frames and noise.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <vector>

#include "firmware/modbus/rtu_port.hpp"
#include "tests/firmware/modbus/rtu_client.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::rtu_port_noise_test {
namespace {

Bytes some_request(std::uint8_t unit) {
  static const std::vector<Bytes> pdus{{3, 0, 2, 0, 1},
                                       {4, 0, 0, 0, 9},
                                       {6, 0, 2, 0x12, 0x34},
                                       {6, 0, 0x40, 1, 1},
                                       {16, 0, 2, 0, 2, 4, 1, 2, 3, 4},
                                       {16, 0, 0x41, 0, 2, 4, 1, 2, 3, 4},
                                       {22, 0, 3, 0xF0, 0xF0, 1, 1},
                                       {23, 0, 0, 0, 2, 0, 4, 0, 1, 2, 9, 9},
                                       {23, 2, 0, 0, 2, 0, 4, 0, 1, 2, 9, 9},
                                       {43, 14, 1, 0},
                                       {43, 14, 4, 9},
                                       {99, 1}};
  return adu(unit, *rc::gen::elementOf(pdus));
}

// What the client sends is damaged in every way a line can: never a reply or a write for a frame with a bad
// CRC, never a change with an exception, and the next good request is answered.
RC_GTEST_PROP(RtuPortNoise, DamagedTrafficIsHarmless, ()) {
  const auto start = *rc::gen::element<std::uint32_t>(0, 0xFFFF'0000, 0x7FFF'0000);
  const auto echo = *rc::gen::arbitrary<bool>();
  RtuClient client({.unit = 1, .baud_rate = tested_baud_rates[*rc::gen::inRange<std::size_t>(0, 8)]}, start);
  for (int i = 0; i < 10; ++i) {
    Bytes frame = *rc::gen::inRange(0, 4) == 0
                      ? *rc::gen::resize(300, rc::gen::arbitrary<Bytes>())
                      : some_request(*rc::gen::element<std::uint8_t>(0, 1, 1, 1, 2, 250));
    switch (*rc::gen::inRange(0, 5)) {
      case 0:
        if (!frame.empty())
          frame[*rc::gen::inRange<std::size_t>(0, frame.size())] ^= *rc::gen::inRange<std::uint8_t>(1, 255);
        break;
      case 1:
        frame.resize(*rc::gen::inRange<std::size_t>(0, frame.size() + 1));
        break;
      case 2:
        frame.insert(frame.end(), *rc::gen::inRange<std::size_t>(1, 300),
                     *rc::gen::arbitrary<std::uint8_t>());
        break;
      default:
        break;
    }
    const auto line_error_at = *rc::gen::inRange<std::size_t>(0, 60);
    const auto before = client.bank.holding;
    for (std::size_t k = 0; k < frame.size(); ++k)
      client.port.receive(frame[k], k == line_error_at, client.line.character());
    client.settle();
    client.port.poll(client.line.now());
    const Bytes reply = client.take_reply(echo);
    const bool good = frame.size() >= 4 && frame.size() <= 256 && line_error_at >= frame.size() &&
                      with_crc(Bytes(frame.begin(), frame.end() - 2)) == frame;
    RC_ASSERT(reply.empty() != (good && frame[0] == 1));
    if (!good || frame[0] > 1) RC_ASSERT(client.bank.holding == before);
    if (!reply.empty()) {
      RC_ASSERT(reply[0] == 1);
      RC_ASSERT(with_crc(Bytes(reply.begin(), reply.end() - 2)) == reply);
      if ((reply[1] & 0x80) != 0) RC_ASSERT(client.bank.holding == before);
    }
    client.settle();
  }
  RC_ASSERT(!client.bank.asked_beyond_contract);
  RC_ASSERT(client.is_alive());
}

// Random characters at random distances, errors included, with calls in any order.
RC_GTEST_PROP(RtuPortNoise, NoiseNeverGetsAReplyAndNeverStopsThePort, ()) {
  RtuClient client({}, *rc::gen::element<std::uint32_t>(0, 0xFFFF'F000));
  const auto before = client.bank.holding;
  const auto count = *rc::gen::inRange(0, 600);
  for (int i = 0; i < count; ++i) {
    // No frame for unit 0 or 1 can begin in this alphabet.
    const auto byte = *rc::gen::inRange<std::uint8_t>(2, 255);
    client.line.silence(*rc::gen::element(0.0, 0.0, 0.0, 0.0, 400.0, 800.0, 1740.0, 1760.0, 5000.0));
    client.port.receive(byte, *rc::gen::inRange(0, 100) == 0, client.line.character());
    if (*rc::gen::inRange(0, 10) == 0) client.port.poll(client.line.now());
    if (*rc::gen::inRange(0, 10) == 0) RC_ASSERT(client.port.reply_due(client.line.now()).empty());
    if (*rc::gen::inRange(0, 50) == 0) client.port.reply_sent(client.line.now());
  }
  RC_ASSERT(client.bank.holding == before);
  RC_ASSERT(client.is_alive());
}

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_port_noise_test
