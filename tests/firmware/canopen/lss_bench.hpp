#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>

#include "firmware/canopen/lss_slave.hpp"

namespace kmax::firmware::canopen::lss_test {

using drivers::CanFrame;
using Bytes = std::array<std::uint8_t, 8>;

inline constexpr LssIdentity identity{0x0000'05B5, 0x1234'5678, 0x0001'0002, 0xDEAD'BEEF};

inline CanFrame request(const Bytes& data) {
  return {.identifier = 0x7E5, .length = 8, .data = data};
}
inline CanFrame response(const Bytes& data) {
  return {.identifier = 0x7E4, .length = 8, .data = data};
}

inline CanFrame numbered(std::uint8_t specifier, std::uint32_t number) {
  return request({specifier, static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8),
                  static_cast<std::uint8_t>(number >> 16), static_cast<std::uint8_t>(number >> 24)});
}

// A slave and the answer to each request.
struct Bench {
  explicit Bench(std::uint8_t node_id = unconfigured_node_id, const LssIdentity& who = identity)
      : slave(who) {
    slave.start(node_id, 500'000);
  }

  std::optional<CanFrame> ask(const CanFrame& frame) {
    action = slave.receive(frame, now_us);
    return answer();
  }

  std::optional<CanFrame> answer() {
    CanFrame frame;
    return slave.next_frame(frame) ? std::optional(frame) : std::nullopt;
  }

  void configure() {
    EXPECT_FALSE(ask(request({0x04, 1})));
    EXPECT_TRUE(slave.configuring());
  }

  LssSlave slave;
  LssAction action = LssAction::none;
  std::uint32_t now_us = 0xFFFF'F000;
};

}  // namespace kmax::firmware::canopen::lss_test
