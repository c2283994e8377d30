#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

// What the kernel says of the USB devices that are plugged in, from its files; opens none of them.

namespace kmax::usb {

struct UsbDevice {
  std::uint16_t vendor, product;
  std::string serial;  ///< empty if it has none
  std::string maker{};
  /// Where it is plugged in, as the kernel and dfu-util write it ("1-1.2"). It stays when the device comes
  /// back as another one.
  std::string port{};
  unsigned bus = 0, number = 0;          ///< of its node below /dev/bus/usb; 0: not known
  std::vector<std::string> terminals{};  ///< "ttyACM0"; empty while no driver has its serial port
  std::vector<std::string> can{};        ///< interfaces in the order of its channels; empty likewise

  bool is_st_link() const;
  /// The ROM bootloader of an STM32 in DFU mode.
  bool is_dfu() const { return vendor == 0x0483 && product == 0xDF11; }
  /// Our firmware, and not another CAN adapter of the same numbers.
  bool is_kmax() const;
  /// What --device takes for it.
  std::string address() const { return serial.empty() ? "usb" : "usb:" + serial; }
  /// "001/004" below /dev/bus/usb, which asking it something itself, not through a driver, opens.
  std::string node() const;
};

inline const std::filesystem::path kernel_usb_devices = "/sys/bus/usb/devices";
inline const std::filesystem::path kernel_usb_nodes = "/dev/bus/usb";

/// In the order of their ports. Empty where the kernel has no USB.
std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& folder = kernel_usb_devices);

/// Whether this user may read and write a file that is there.
bool may_open(const std::filesystem::path& file);

/// What to do where may_open() says no.
inline constexpr std::string_view permission_advice =
    "install the udev rules of 60-kmax.rules and plug it in again, or run this as root (docs/usb.md)";

}  // namespace kmax::usb
