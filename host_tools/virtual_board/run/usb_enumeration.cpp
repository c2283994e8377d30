#include "host_tools/virtual_board/run/usb_enumeration.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kmax::virtual_board {

namespace {

constexpr std::size_t device_size = 18, configuration_size = 9, interface_size = 9, endpoint_size = 7;
constexpr std::uint8_t device_type = 1, configuration_type = 2, interface_type = 4, endpoint_type = 5;
constexpr std::uint8_t get_descriptor = 6, set_address = 5;

std::uint16_t word_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

std::array<std::uint8_t, 8> descriptor_request(std::uint8_t type, std::size_t length) {
  return {0x80,
          get_descriptor,
          0,
          type,
          0,
          0,
          static_cast<std::uint8_t>(length),
          static_cast<std::uint8_t>(length >> 8)};
}

UsbDescription::Endpoint endpoint_of(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  constexpr unsigned bulk = 2, interrupt = 3;
  const unsigned kind = bytes[at + 3] & 3U;
  if (kind != bulk && kind != interrupt) {
    throw std::runtime_error(fmt::format(
        "endpoint 0x{:02X} is of kind {}; bulk (2) and interrupt (3) are modelled", bytes[at + 2], kind));
  }
  return {.address = bytes[at + 2],
          .kind = kind == bulk ? UsbTransferKind::bulk : UsbTransferKind::interrupt,
          .largest_packet = word_at(bytes, at + 4) & 0x7FFU,
          .interval_frames = bytes[at + 6]};
}

}  // namespace

UsbDescription describe_usb_device(const std::vector<std::uint8_t>& device,
                                   const std::vector<std::uint8_t>& configuration) {
  if (device.size() < device_size || device[1] != device_type)
    throw std::runtime_error(fmt::format("the device descriptor has {} of 18 bytes", device.size()));
  if (configuration.size() < configuration_size || configuration[1] != configuration_type ||
      configuration.size() < word_at(configuration, 2)) {
    throw std::runtime_error(
        fmt::format("the configuration descriptor is cut off after {} bytes", configuration.size()));
  }
  UsbDescription description{.vendor = word_at(device, 8),
                             .product = word_at(device, 10),
                             .release = word_at(device, 12),
                             .device_class = device[4],
                             .subclass = device[5],
                             .protocol = device[6],
                             .configurations = device[17],
                             .configuration = configuration[5],
                             .largest_packet_0 = device[7]};
  for (std::size_t at = 0; at < configuration.size(); at += configuration[at]) {
    const std::size_t size = configuration[at];
    if (size < 2 || at + size > configuration.size()) {
      throw std::runtime_error(
          fmt::format("a descriptor of {} bytes at byte {} of the {} of the configuration", size, at,
                      configuration.size()));
    }
    const std::uint8_t type = configuration[at + 1];
    if (type == interface_type && size >= interface_size && configuration[at + 3] == 0) {
      description.interfaces.push_back({configuration[at + 5], configuration[at + 6], configuration[at + 7]});
    }
    if (type == endpoint_type && size >= endpoint_size)
      description.endpoints.push_back(endpoint_of(configuration, at));
  }
  return description;
}

UsbEnumeration::UsbEnumeration(UsbHostPort& port) : port_(port) {
  port_.on_state([this](UsbHostPort::State state, BoardTime now) { on_state(state, now); });
}

UsbEnumeration::~UsbEnumeration() {
  port_.on_state({});
  port_.detach(0);  // ends what has been asked, whose answers come here
}

void UsbEnumeration::plug_in(BoardTime now) {
  trouble_ = "it does not pull D+ up: no image with USB runs, or it has not begun yet";
  port_.attach(now);
}

void UsbEnumeration::pull_out(BoardTime now) {
  port_.detach(now);
}

void UsbEnumeration::ask(std::uint8_t to, std::array<std::uint8_t, 8> setup, std::size_t length,
                         const char* what,
                         std::function<void(const std::vector<std::uint8_t>&, BoardTime)> next,
                         BoardTime now) {
  port_.submit({.kind = UsbTransferKind::control,
                .address = to,
                .setup = setup,
                .length = length,
                .on_end =
                    [this, what, next = std::move(next)](const UsbTransferResult& result, BoardTime at) {
                      if (result.end == UsbTransferEnd::done) return next(result.data, at);
                      trouble_ = fmt::format("it did not answer {}", what);
                    }},
               now);
}

void UsbEnumeration::on_state(UsbHostPort::State state, BoardTime now) {
  if (state == UsbHostPort::State::suspended || state == UsbHostPort::State::resuming) return;
  if (state != UsbHostPort::State::ready) return device_.reset();
  if (device_) return;  // it has been resumed
  const auto describe = [this](const std::vector<std::uint8_t>& configuration, BoardTime) {
    try {
      device_ = describe_usb_device(descriptor_, configuration);
    } catch (const std::runtime_error& error) {
      trouble_ = error.what();
    }
  };
  const auto whole_configuration = [this, describe](const std::vector<std::uint8_t>& head, BoardTime at) {
    if (head.size() < configuration_size) return describe(head, at);
    const std::size_t length = word_at(head, 2);
    ask(address, descriptor_request(configuration_type, length), length, "for its configuration", describe,
        at);
  };
  const auto configuration = [this, whole_configuration](const std::vector<std::uint8_t>&, BoardTime at) {
    ask(address, descriptor_request(configuration_type, configuration_size), configuration_size,
        "for the head of its configuration", whole_configuration, at);
  };
  const auto address_it = [this, configuration](const std::vector<std::uint8_t>& device, BoardTime at) {
    descriptor_ = device;
    ask(0, {0, set_address, address, 0, 0, 0, 0, 0}, 0, "SET_ADDRESS", configuration, at);
  };
  ask(0, descriptor_request(device_type, device_size), device_size, "for its device descriptor", address_it,
      now);
}

}  // namespace kmax::virtual_board
