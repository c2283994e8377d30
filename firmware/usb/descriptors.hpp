#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/usb/protocol.hpp"

namespace kmax::firmware::usb {

/// What the device is to a host: two functions in one configuration.
///
///   interface 0      CAN adapter, protocol of gs_usb: bulk IN 0x81, bulk OUT 0x02
///   interfaces 1, 2  serial port, CDC ACM (PSTN 1.2): interrupt IN 0x83; bulk IN 0x82, bulk OUT 0x03
///
/// Linux binds gs_usb and cdc_acm to them without any set-up; gs_usb wants these two addresses and interface
/// number 0. The controller has three endpoints each way beside endpoint 0: with these, no IN one is left.

/// pid.codes lists 0x1209:0x2323 as candleLight, https://pid.codes/1209/2323/: an open number that Linux'
/// gs_usb (drivers/net/can/usb/gs_usb.c) binds to, at interface number 0. It says "speaks gs_usb there",
/// which is true of this device; who made it is in the strings.
struct Identity {
  std::uint16_t vendor, product;
};
inline constexpr Identity identity{0x1209, 0x2323};

inline constexpr std::uint8_t can_interface = 0, serial_interface = 1, serial_data_interface = 2;
inline constexpr std::uint8_t interface_count = 3;

inline constexpr Endpoint can_to_host{0x81, EndpointType::bulk, full_packet};
inline constexpr Endpoint can_from_host{0x02, EndpointType::bulk, full_packet};
inline constexpr Endpoint serial_to_host{0x82, EndpointType::bulk, full_packet};
inline constexpr Endpoint serial_from_host{0x03, EndpointType::bulk, full_packet};
/// Never used, but the class wants it.
inline constexpr Endpoint serial_notification{0x83, EndpointType::interrupt, 8};

struct EndpointOfInterface {
  std::uint8_t interface;
  Endpoint endpoint;
};
inline constexpr auto endpoints = std::to_array<EndpointOfInterface>({
    {can_interface, can_to_host},
    {can_interface, can_from_host},
    {serial_interface, serial_notification},
    {serial_data_interface, serial_to_host},
    {serial_data_interface, serial_from_host},
});

/// Of string descriptors.
enum class Text : std::uint8_t {
  languages = 0,
  maker = 1,
  product = 2,
  serial_number = 3,
  can = 4,
  serial = 5
};
inline constexpr std::uint16_t english = 0x0409;  ///< United States; the only language

namespace detail {
constexpr std::uint8_t low(unsigned word) {
  return static_cast<std::uint8_t>(word);
}
constexpr std::uint8_t high(unsigned word) {
  return static_cast<std::uint8_t>(word >> 8);
}
constexpr std::uint8_t of(DescriptorType type) {
  return static_cast<std::uint8_t>(type);
}
constexpr std::uint8_t of(Text text) {
  return static_cast<std::uint8_t>(text);
}

template <std::size_t... sizes>
constexpr auto joined(const std::array<std::uint8_t, sizes>&... parts) {
  std::array<std::uint8_t, (sizes + ...)> whole{};
  auto at = whole.begin();
  ((at = std::copy(parts.begin(), parts.end(), at)), ...);
  return whole;
}

constexpr std::array<std::uint8_t, 9> interface_descriptor(std::uint8_t number, std::uint8_t endpoint_count,
                                                           std::array<std::uint8_t, 3> class_and_protocol,
                                                           std::uint8_t text) {
  return {9,
          of(DescriptorType::interface),
          number,
          0,  // the only alternate setting
          endpoint_count,
          class_and_protocol[0],
          class_and_protocol[1],
          class_and_protocol[2],
          text};
}
constexpr std::array<std::uint8_t, 7> endpoint_descriptor(const Endpoint& endpoint) {
  // An interrupt endpoint is asked every 16 ms; bulk ones have no interval.
  return {7,
          of(DescriptorType::endpoint),
          endpoint.address,
          static_cast<std::uint8_t>(endpoint.type),
          low(endpoint.packet_bytes),
          high(endpoint.packet_bytes),
          static_cast<std::uint8_t>(endpoint.type == EndpointType::interrupt ? 16 : 0)};
}

inline constexpr std::array<std::uint8_t, 3> vendor_specific{0xFF, 0xFF, 0xFF};
/// Communications, abstract control model, no protocol: with the protocol of AT commands a PC's modem manager
/// would send some to the device.
inline constexpr std::array<std::uint8_t, 3> abstract_control{0x02, 0x02, 0x00};
inline constexpr std::array<std::uint8_t, 3> data_interface{0x0A, 0x00, 0x00};

inline constexpr auto functions = joined(
    interface_descriptor(can_interface, 2, vendor_specific, of(Text::can)), endpoint_descriptor(can_to_host),
    endpoint_descriptor(can_from_host),
    std::array<std::uint8_t, 8>{8, of(DescriptorType::interface_association), serial_interface, 2, 0x02, 0x02,
                                0x00, of(Text::serial)},
    interface_descriptor(serial_interface, 1, abstract_control, of(Text::serial)),
    // CDC 1.2, 5.2.3, and PSTN 1.2, 5.3: header with the release 1.10, call management (none),
    // abstract control management (line coding and control line state), union of both interfaces.
    std::array<std::uint8_t, 5>{5, of(DescriptorType::class_interface), 0x00, 0x10, 0x01},
    std::array<std::uint8_t, 5>{5, of(DescriptorType::class_interface), 0x01, 0x00, serial_data_interface},
    std::array<std::uint8_t, 4>{4, of(DescriptorType::class_interface), 0x02, 0x02},
    std::array<std::uint8_t, 5>{5, of(DescriptorType::class_interface), 0x06, serial_interface,
                                serial_data_interface},
    endpoint_descriptor(serial_notification),
    interface_descriptor(serial_data_interface, 2, data_interface, 0), endpoint_descriptor(serial_to_host),
    endpoint_descriptor(serial_from_host));
}  // namespace detail

/// Section 9.6.1. The class says that interface associations follow.
constexpr std::array<std::uint8_t, 18> device_descriptor(std::uint16_t release) {
  using namespace detail;
  return {18,
          of(DescriptorType::device),
          0x00,
          0x02,  // USB 2.00
          0xEF,
          0x02,
          0x01,
          full_packet,
          low(identity.vendor),
          high(identity.vendor),
          low(identity.product),
          high(identity.product),
          low(release),
          high(release),
          of(Text::maker),
          of(Text::product),
          of(Text::serial_number),
          1};
}

/// Section 9.6.3. The board has a supply of its own and takes nothing from the bus; no remote wake-up.
inline constexpr auto configuration_descriptor = [] {
  constexpr std::size_t size = 9 + detail::functions.size();
  return detail::joined(
      std::array<std::uint8_t, 9>{9, detail::of(DescriptorType::configuration), detail::low(size),
                                  detail::high(size), interface_count, 1, 0, 0xC0, 0},
      detail::functions);
}();

/// All but the serial number; empty where there is none.
constexpr std::string_view text_of(Text text) {
  switch (text) {
    case Text::maker:
      return "Kmax";
    case Text::product:
      return "Haptic controller";
    case Text::can:
      return "Kmax CAN";
    case Text::serial:
      return "Kmax Modbus";
    default:
      return {};
  }
}

using TextDescriptor = std::array<std::uint8_t, full_packet>;

/// Section 9.6.7: in UTF-16. At most 31 characters of ASCII.
constexpr std::span<const std::uint8_t> text_descriptor(std::string_view text, TextDescriptor& out) {
  const std::size_t count = std::min(text.size(), (out.size() - 2) / 2);
  out[0] = static_cast<std::uint8_t>(2 + 2 * count);
  out[1] = detail::of(DescriptorType::string);
  for (std::size_t i = 0; i < count; ++i) {
    out[2 + 2 * i] = static_cast<std::uint8_t>(text[i]);
    out[3 + 2 * i] = 0;
  }
  return std::span(out).first(out[0]);
}

/// Eight hexadecimal digits: the number that info.serial_number shows.
constexpr std::array<char, 8> serial_number_text(std::uint32_t number) {
  std::array<char, 8> text{};
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = "0123456789ABCDEF"[number >> (28 - 4 * i) & 0xF];
  return text;
}

}  // namespace kmax::firmware::usb
