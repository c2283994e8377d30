// A USB host and the wire to it: a controller that keeps to what EndpointController promises and counts what
// it must never be asked, and the transfers of chapter 8 and 9 as a host makes them.
#pragma once

#include <gtest/gtest.h>

#include <array>
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
    EXPECT_NE(number_of(endpoint.address), 0);
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

/// What a host's control transfer came to: nothing is a STALL.
using Reply = std::optional<Bytes>;

template <typename Device>
class FakeHost {
 public:
  FakeHost(FakeController& wire, Device& device) : wire_(wire), device_(device) {}

  void reset() {
    wire_.begin();
    device_.ISR_reset();
  }

  void set_up(const SetupPacket& setup) {
    wire_.begin_control();
    const auto low = [](std::uint16_t word) { return static_cast<std::uint8_t>(word); };
    const auto high = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
    const std::array<std::uint8_t, setup_bytes> bytes{
        setup.request_type, setup.request,     low(setup.value),  high(setup.value),
        low(setup.index),   high(setup.index), low(setup.length), high(setup.length)};
    device_.ISR_set_up(bytes);
  }

  /// A read: data stage to its end, then the status stage.
  Reply read(const SetupPacket& setup) {
    set_up(setup);
    Bytes all;
    while (!wire_.control_stalled) {
      auto& packet = wire_.side(direction_in).packet;
      if (!packet) {
        ADD_FAILURE() << "neither data nor STALL";
        return std::nullopt;
      }
      const Bytes some = *packet;
      packet.reset();
      all.insert(all.end(), some.begin(), some.end());
      const bool last = some.size() < full_packet || all.size() >= setup.length;
      device_.ISR_sent(0);
      if (!last) continue;
      EXPECT_FALSE(wire_.side(direction_in).packet) << "more than the host asked for";
      EXPECT_TRUE(wire_.side(0).receiving) << "the status stage is refused";
      wire_.side(0).receiving = false;
      device_.ISR_received(0, {});
      return all;
    }
    return std::nullopt;
  }

  /// A write, or a request without data.
  bool write(const SetupPacket& setup, const Bytes& data = {}) {
    set_up(setup);
    if (setup.length != 0 && !wire_.control_stalled) {
      EXPECT_TRUE(wire_.side(0).receiving);
      wire_.side(0).receiving = false;
      device_.ISR_received(0, data);
    }
    if (wire_.control_stalled) return false;
    EXPECT_EQ(wire_.side(direction_in).packet, Bytes{}) << "no status stage";
    EXPECT_NE(wire_.address, wire_.next_address) << "the address before the end of the status stage";
    wire_.side(direction_in).packet.reset();
    device_.ISR_sent(0);
    if (wire_.next_address) wire_.address = *wire_.next_address;
    wire_.next_address.reset();
    return true;
  }

  /// As a host finds a device: reset, address, configuration.
  void enumerate() {
    reset();
    EXPECT_TRUE(write({0x00, 5, 17, 0, 0}));
    EXPECT_TRUE(write({0x00, 9, 1, 0, 0}));
  }

  /// A packet to a bulk endpoint; false: NAK or STALL.
  bool put(std::uint8_t number, const Bytes& data) {
    auto& side = wire_.side(number);
    if (!side.receiving || side.stalled) return false;
    side.receiving = false;
    side.second_data = !side.second_data;
    device_.ISR_received(number, data);
    return true;
  }
  /// A packet from one; nothing: NAK or STALL.
  Reply take(std::uint8_t number) {
    auto& side = wire_.side(static_cast<std::uint8_t>(number | direction_in));
    if (!side.packet || side.stalled) return std::nullopt;
    const Bytes data = *side.packet;
    side.packet.reset();
    side.second_data = !side.second_data;
    device_.ISR_sent(number);
    return data;
  }

 private:
  FakeController& wire_;
  Device& device_;
};

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

/// The whole device of this firmware at such a host.
template <typename Link = FakeLink>
struct DeviceAtHost {
  using Behaviour = Functions<FakeController, Link, FakeClock>;

  explicit DeviceAtHost(Link& behind) : link(behind) {}

  Link& link;
  FakeController wire;
  FakeClock clock;
  Behaviour functions{wire, link, clock};
  Device<FakeController, Behaviour> device{
      wire, functions, {.serial_number = 0x1234'ABCD, .release = 0x0102}};
  FakeHost<Device<FakeController, Behaviour>> host{wire, device};
};

}  // namespace kmax::firmware::usb
