// A controller that keeps to what EndpointController promises and counts what it must never be asked, and
// what stands in place of the main loop's links.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "firmware/usb/device.hpp"
#include "firmware/usb/functions.hpp"

namespace kmax::firmware::usb {

using Bytes = std::vector<std::uint8_t>;

struct FakeController {
  struct Side {
    bool open = false, stalled = false, second_data = false;
    std::optional<Bytes> packet;  ///< to the host
    bool receiving = false;       ///< from the host
    std::uint16_t size = full_packet;
  };

  Side& side(std::uint8_t of) { return sides[of]; }

  void ISR_open(const Endpoint& endpoint) {
    broken_promises += number_of(endpoint.address) == 0;
    side(endpoint.address) = {};
    side(endpoint.address).open = true;
    side(endpoint.address).size = endpoint.packet_bytes;
  }
  void ISR_close(std::uint8_t of) { side(of) = {}; }
  void ISR_take_address(std::uint8_t wanted) { next_address = wanted; }
  void ISR_send(std::uint8_t number, std::span<const std::uint8_t> data) {
    Side& to_host = side(static_cast<std::uint8_t>(number | direction_in));
    broken_promises +=
        to_host.packet.has_value() || data.size() > to_host.size || (number != 0 && !to_host.open);
    to_host.packet = Bytes(data.begin(), data.end());
  }
  void ISR_take_back(std::uint8_t number) {
    broken_promises += number == 0;
    side(static_cast<std::uint8_t>(number | direction_in)).packet.reset();
  }
  void ISR_receive(std::uint8_t number) {
    broken_promises += number != 0 && (!side(number).open || side(number).receiving);
    side(number).receiving = true;
  }
  void ISR_stall(std::uint8_t of) {
    side(of).stalled = true;
    side(of).packet.reset();
    side(of).receiving = false;
  }
  void ISR_clear_stall(std::uint8_t of) {
    side(of).stalled = side(of).second_data = side(of).receiving = false;
    side(of).packet.reset();
  }
  void ISR_stall_control() { control_stalled = true; }

  void begin() {
    sides.clear();
    control_stalled = false;
    address = 0;
    next_address.reset();
  }
  void begin_control() {
    control_stalled = false;
    side(0).receiving = false;
    side(direction_in).packet.reset();
  }

  std::map<std::uint8_t, Side> sides;
  bool control_stalled = false;
  std::uint8_t address = 0;
  std::optional<std::uint8_t> next_address;
  int broken_promises = 0;
};
static_assert(EndpointController<FakeController>);

/// In place of the Modbus server.
struct FakeLink {
  bool has_room = true;
  std::vector<Bytes> packets;
  int restarts = 0;

  bool ISR_has_room() const { return has_room; }
  void ISR_packet(std::span<const std::uint8_t> bytes, std::uint32_t) {
    packets.emplace_back(bytes.begin(), bytes.end());
  }
  void ISR_restart() { ++restarts; }
};
struct FakeClock {
  std::uint32_t now = 0;
  std::uint32_t now_us() const { return now; }
};

}  // namespace kmax::firmware::usb
