#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/can/can_discovery.hpp"
#include "host_tools/usb/usb_devices.hpp"

namespace kmax::cli {

/// A place where a device may be.
struct ReachableDevice {
  std::string address;      ///< for --device; empty: it cannot be talked to now
  std::string description;  ///< what is known about it
};

/// Kmax devices on USB, and what each offers: its serial port and CAN interfaces, or what to do to get them.
/// `may_open`: whether a file below `dev` (/dev) may be opened. Boards in DFU mode come behind them.
std::vector<ReachableDevice> usb_devices(std::span<const usb::UsbDevice> devices,
                                         const std::filesystem::path& dev,
                                         const std::function<bool(const std::filesystem::path&)>& may_open);

/// Serial ports that a device may be plugged into, under `dev` (/dev): those of USB, by the name that stays
/// the same where there is one. A port is not opened, since whatever is on it might take that amiss.
std::vector<ReachableDevice> serial_ports(const std::filesystem::path& dev,
                                          std::span<const usb::UsbDevice> devices = {});

/// CAN interfaces under `net` (/sys/class/net): those of the kernel's type ARPHRD_CAN (280).
std::vector<ReachableDevice> can_interfaces(const std::filesystem::path& net,
                                            std::span<const usb::UsbDevice> devices = {});

/// The nodes on a bus as devices: those that are Kmax controllers have an address.
std::vector<ReachableDevice> nodes_on(const std::string& bus, const std::vector<device::FoundNode>& nodes);

}  // namespace kmax::cli
