#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"

namespace kmax::virtual_board {

/// What a host has to know of a device before it can offer it: Universal Serial Bus Specification 2.0,
/// section 9.6, descriptors.
struct UsbDescription {
  struct Interface {
    std::uint8_t device_class = 0, subclass = 0, protocol = 0;
  };
  struct Endpoint {
    std::uint8_t address = 0;  ///< bit 7: IN
    UsbTransferKind kind = UsbTransferKind::bulk;
    std::uint32_t largest_packet = 64;
    std::uint8_t interval_frames = 1;
  };

  std::uint16_t vendor = 0, product = 0, release = 0;
  std::uint8_t device_class = 0, subclass = 0, protocol = 0, configurations = 0;
  std::uint8_t configuration = 0;  ///< value of the first one
  std::uint32_t largest_packet_0 = 64;
  std::vector<Interface> interfaces{};  ///< their first settings
  std::vector<Endpoint> endpoints{};
};

/// Reads a description out of a device descriptor and the first configuration with all that follows it.
/// Throws std::runtime_error with what is wrong in them.
UsbDescription describe_usb_device(const std::vector<std::uint8_t>& device,
                                   const std::vector<std::uint8_t>& configuration);

/// Plugs the board in and does the first steps of a host: reset, device descriptor, address 1, configuration
/// descriptor. Does it again when the device comes back after it has let go.
class UsbEnumeration {
 public:
  static constexpr std::uint8_t address = 1;

  /// The port must outlive this, and is its alone.
  explicit UsbEnumeration(UsbHostPort& port);
  ~UsbEnumeration();
  UsbEnumeration(const UsbEnumeration&) = delete;
  UsbEnumeration& operator=(const UsbEnumeration&) = delete;

  void plug_in(BoardTime now);
  void pull_out(BoardTime now);
  bool plugged_in() const { return port_.state() != UsbHostPort::State::unplugged; }
  /// The device that is ready; none so far.
  const std::optional<UsbDescription>& device() const { return device_; }
  /// Why there is none, in words.
  const std::string& trouble() const { return trouble_; }

 private:
  void on_state(UsbHostPort::State state, BoardTime now);
  void ask(std::uint8_t to, std::array<std::uint8_t, 8> setup, std::size_t length, const char* what,
           std::function<void(const std::vector<std::uint8_t>&, BoardTime)> next, BoardTime now);

  UsbHostPort& port_;
  std::optional<UsbDescription> device_;
  std::vector<std::uint8_t> descriptor_;
  std::string trouble_;
};

}  // namespace kmax::virtual_board
