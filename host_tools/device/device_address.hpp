#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::device {

/// An address that cannot be meant; the message says what is allowed.
class AddressError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// What a parameter is when a device comes from the factory.
template <typename Number, firmware::FixedName name>
constexpr Number factory_default() {
  return static_cast<Number>(firmware::entry_at(firmware::entry_of<name>()).default_value);
}

/// Where a device is, as a user writes it:
///
///   sim                              a simulated device in this process
///   usb[:SERIAL][?unit=1]            Modbus RTU on the serial port of the only Kmax device on USB, or of the
///                                    one with this serial number, wherever it is plugged in
///   serial:PATH[?unit=1&baud=115200] Modbus RTU on a serial port, 8 data bits, even parity, 1 stop bit
///   can:IFACE[?node=1]               CANopen on a SocketCAN interface, or on a bus at a Unix socket whose
///                                    path is written with a '/' in it
///
/// Left-out options are what a device has from the factory (modbus.unit, modbus.baud_rate, node.id).
struct DeviceAddress {
  enum class Kind : std::uint8_t { sim, serial, can, usb };

  Kind kind = Kind::sim;
  std::string path{};  ///< of the port, or the name of the interface, or the serial number; empty: the only
  std::uint8_t unit = factory_default<std::uint8_t, "modbus.unit">();
  std::uint32_t baud_rate = factory_default<std::uint32_t, "modbus.baud_rate">();
  std::uint8_t node = factory_default<std::uint8_t, "node.id">();

  friend bool operator==(const DeviceAddress&, const DeviceAddress&) = default;
};

/// Throws AddressError.
DeviceAddress parse_device_address(std::string_view text);

/// The shortest text that parses to the same address.
std::string text_of(const DeviceAddress& address);

/// KMAX_DEVICE, if it is set and not empty.
std::optional<std::string> device_address_of_environment();

}  // namespace kmax::device
