#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace kmax::firmware::usb {

/// USB 2.0, chapter 9: numbers of the standard and the classes, and the words of a set-up packet.

enum class StandardRequest : std::uint8_t {  // table 9-4
  get_status = 0,
  clear_feature = 1,
  set_feature = 3,
  set_address = 5,
  get_descriptor = 6,
  set_descriptor = 7,
  get_configuration = 8,
  set_configuration = 9,
  get_interface = 10,
  set_interface = 11,
  synch_frame = 12,
};

enum class DescriptorType : std::uint8_t {  // table 9-5
  device = 1,
  configuration = 2,
  string = 3,
  interface = 4,
  endpoint = 5,
  device_qualifier = 6,
  interface_association = 11,  // the ECN of that name
  class_interface = 0x24,      // CDC 1.2, table 12
};

inline constexpr std::uint16_t feature_endpoint_halt = 0;  // table 9-6

enum class RequestKind : std::uint8_t { standard = 0, of_class = 1, vendor = 2, reserved = 3 };
enum class Recipient : std::uint8_t { device = 0, interface = 1, endpoint = 2, other = 3 };

enum class EndpointType : std::uint8_t { control = 0, isochronous = 1, bulk = 2, interrupt = 3 };

inline constexpr std::uint8_t direction_in = 0x80;  ///< to the host, in endpoint addresses and request types
constexpr bool is_in(std::uint8_t address) {
  return (address & direction_in) != 0;
}
constexpr std::uint8_t number_of(std::uint8_t address) {
  return address & 0x0F;
}

inline constexpr std::size_t setup_bytes = 8;
/// Of endpoint 0, and of a bulk endpoint at full speed.
inline constexpr std::size_t full_packet = 64;

/// Section 9.3.
struct SetupPacket {
  std::uint8_t request_type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0, index = 0, length = 0;

  constexpr bool to_host() const { return is_in(request_type); }
  constexpr RequestKind kind() const { return static_cast<RequestKind>(request_type >> 5 & 3); }
  /// Numbers from 4 on are reserved.
  constexpr std::uint8_t recipient_number() const { return request_type & 0x1F; }
  constexpr bool is_for(Recipient recipient) const {
    return recipient_number() == static_cast<std::uint8_t>(recipient);
  }
};

constexpr SetupPacket setup_packet(std::span<const std::uint8_t, setup_bytes> bytes) {
  const auto word = [bytes](std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
  };
  return {bytes[0], bytes[1], word(2), word(4), word(6)};
}

/// An endpoint as its descriptor says.
struct Endpoint {
  std::uint8_t address;
  EndpointType type;
  std::uint16_t packet_bytes;
};

}  // namespace kmax::firmware::usb
