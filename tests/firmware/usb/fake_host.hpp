// A USB host at the whole device: the transfers of chapters 8 and 9 as a host makes them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>

#include "tests/firmware/usb/fake_controller.hpp"

namespace kmax::firmware::usb {

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

/// The whole device of this firmware at such a host.
template <typename Link = FakeLink>
struct DeviceAtHost {
  using Behaviour = Functions<FakeController, Link, FakeClock>;

  explicit DeviceAtHost(Link& behind) : link(behind) {}

  Link& link;
  FakeController wire;
  FakeClock clock;
  Behaviour functions{wire, link, clock, 42'000'000};
  Device<FakeController, Behaviour> device{
      wire, functions, {.serial_number = 0x1234'ABCD, .release = 0x0102}};
  FakeHost<Device<FakeController, Behaviour>> host{wire, device};
};

}  // namespace kmax::firmware::usb
