#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

// What is plugged in, from the kernel's list of USB devices; opens none of them.

namespace kmax::flash {

struct UsbDevice {
  std::uint16_t vendor, product;
  std::string serial;  ///< empty if it has none

  bool is_st_link() const;
  /// The ROM bootloader of an STM32 in DFU mode.
  bool is_dfu() const { return vendor == 0x0483 && product == 0xDF11; }
};

inline const std::filesystem::path kernel_usb_devices = "/sys/bus/usb/devices";

/// Empty where the kernel has no USB.
std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& folder = kernel_usb_devices);

}  // namespace kmax::flash
