#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/canopen/sdo_server.hpp"
#include "tests/firmware/canopen/in_memory_objects.hpp"

namespace kmax::firmware::canopen {

using Eight = std::array<std::uint8_t, 8>;

/// A server, its objects, a clock, and a look at every frame that it sends.
template <std::size_t buffer_size = 2048>
class SdoBench {
 public:
  static constexpr std::uint8_t node_id = 5;

  explicit SdoBench(const SdoConfig& config = {}, std::uint32_t start_us = 0xFFFF'F000U)
      : server(objects, config), now_us(start_us) {
    server.start(node_id);
  }

  void send(const Eight& bytes) {
    now_us += 130;  // a frame at 1 Mbit/s
    const drivers::CanFrame frame{.identifier = 0x600U + node_id, .length = 8, .data = bytes};
    server.receive(frame, now_us);
    server.poll(now_us);
  }

  std::optional<Eight> reply() {
    drivers::CanFrame frame;
    frame.length = 0xFF;
    frame.extended = frame.remote = true;
    if (!server.next_frame(frame, now_us)) return std::nullopt;
    now_us += 130;
    if (frame.identifier != 0x580U + node_id || frame.extended || frame.remote || frame.length != 8) {
      complaints.push_back("a frame of another kind than a response");
    }
    return frame.data;
  }

  /// Sends and returns the answer; 8 bytes of 0xEE if there is none. A second answer is a defect.
  Eight ask(const Eight& bytes) {
    send(bytes);
    const std::optional<Eight> answer = reply();
    if (answer && reply()) complaints.push_back("two answers to one request");
    return answer.value_or(no_answer);
  }

  void wait(std::uint32_t duration_us) {
    for (std::uint32_t passed = 0; passed < duration_us; passed += 500) {
      now_us += 500;
      server.poll(now_us);
    }
  }

  static constexpr Eight no_answer{0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE};

  InMemoryObjects objects;
  SdoServer<InMemoryObjects, buffer_size> server;
  std::uint32_t now_us;
  std::vector<std::string> complaints;  ///< of the bench or the client: what the standard does not allow
};

inline Eight abort_frame(ObjectAddress address, Abort code) {
  const auto c = static_cast<std::uint32_t>(code);
  return {0x80,
          static_cast<std::uint8_t>(address.index & 0xFF),
          static_cast<std::uint8_t>(address.index >> 8),
          address.subindex,
          static_cast<std::uint8_t>(c & 0xFF),
          static_cast<std::uint8_t>(c >> 8 & 0xFF),
          static_cast<std::uint8_t>(c >> 16 & 0xFF),
          static_cast<std::uint8_t>(c >> 24)};
}

/// A request for an object: command, address, four more bytes.
inline Eight request(std::uint8_t command, ObjectAddress address, std::array<std::uint8_t, 4> rest = {}) {
  return {command,
          static_cast<std::uint8_t>(address.index & 0xFF),
          static_cast<std::uint8_t>(address.index >> 8),
          address.subindex,
          rest[0],
          rest[1],
          rest[2],
          rest[3]};
}

/// Bytes that differ from their neighbours and from one multiple of 7 or 112 to the next.
inline Bytes pattern(std::size_t size) {
  Bytes bytes;
  std::uint32_t state = 12345;
  for (std::size_t i = 0; i < size; ++i) {
    state = state * 1664525U + 1013904223U;
    bytes.push_back(static_cast<std::uint8_t>(state >> 24));
  }
  return bytes;
}

}  // namespace kmax::firmware::canopen
