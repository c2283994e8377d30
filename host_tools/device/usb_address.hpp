#pragma once

#include <filesystem>
#include <span>

#include "host_tools/device/device_address.hpp"
#include "host_tools/usb/usb_devices.hpp"

namespace kmax::device {

/// Where the device of a usb address has its serial port now. LinkError: there is none, there are several, it
/// has no port; the message says what to do.
DeviceAddress serial_address_of(const DeviceAddress& usb, std::span<const usb::UsbDevice> devices);

/// The Kmax device on USB that an address of any kind leads to; nullptr if it leads to none, or, of the kind
/// usb, to more than one.
const usb::UsbDevice* usb_device_of(const DeviceAddress& address, std::span<const usb::UsbDevice> devices);

/// "usb:1F2E3D4C, usb:5A6B7C8D": the Kmax devices among these.
std::string usb_addresses(std::span<const usb::UsbDevice> devices);

}  // namespace kmax::device
