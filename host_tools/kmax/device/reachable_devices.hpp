#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/device/can/can_discovery.hpp"

namespace kmax::cli {

/// A place where a device may be.
struct ReachableDevice {
  std::string address;      ///< for --device; empty: it cannot be talked to now
  std::string description;  ///< what is known about it
};

/// Serial ports that a device may be plugged into, under `dev` (/dev): those of USB, by the name that stays
/// the same where there is one. A port is not opened, since whatever is on it might take that amiss.
std::vector<ReachableDevice> serial_ports(const std::filesystem::path& dev);

/// CAN interfaces under `net` (/sys/class/net): those of the kernel's type ARPHRD_CAN (280).
std::vector<ReachableDevice> can_interfaces(const std::filesystem::path& net);

/// The nodes on a bus as devices: those that are Kmax controllers have an address.
std::vector<ReachableDevice> nodes_on(const std::string& bus, const std::vector<link::FoundNode>& nodes);

}  // namespace kmax::cli
