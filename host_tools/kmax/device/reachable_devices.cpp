#include "host_tools/kmax/device/reachable_devices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "firmware/application.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/usb_address.hpp"

namespace kmax::cli {

namespace fs = std::filesystem;

namespace {
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code missing;
  for (fs::directory_iterator entry(folder, missing), end; !missing && entry != end; entry.increment(missing))
    entries.push_back(entry->path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::string first_word(const fs::path& file) {
  std::string word;
  std::ifstream(file) >> word;
  return word;
}

std::string state_words(std::uint8_t state) {
  switch (state) {
    case 0:
      return "starting";
    case 4:
      return "stopped";
    case 5:
      return "operational";
    case 127:
      return "pre-operational";
  }
  return fmt::format("state {}", state);
}

bool is_kmax(const device::FoundNode& node) {
  return node.device_type == firmware::device_type_of_several_axes && node.identity &&
         (*node.identity)[1] == firmware::product_code;
}
}  // namespace

std::vector<ReachableDevice> usb_devices(std::span<const usb::UsbDevice> devices, const fs::path& dev,
                                         const std::function<bool(const fs::path&)>& may_open) {
  std::vector<ReachableDevice> found, in_dfu_mode;
  for (const usb::UsbDevice& device : devices) {
    if (device.is_dfu())
      in_dfu_mode.push_back(
          {"", fmt::format("an STM32 in DFU mode at USB port {}; 'kmax flash' writes firmware into it",
                           device.port)});
    if (!device.is_kmax()) continue;
    const std::string port = device.terminals.empty() ? "" : (dev / device.terminals.front()).string();
    std::string text = fmt::format("Kmax at USB port {}: ", device.port);
    if (port.empty()) {
      text += "no serial port: plug it in again, or 'sudo modprobe cdc_acm'";
    } else if (may_open(port)) {
      text += fmt::format("serial port {}", port);
    } else {
      text += fmt::format("serial port {}, which you may not open: {}", port, usb::permission_advice);
    }
    if (device.can.empty()) {
      text += "; no CAN interfaces: 'sudo modprobe gs_usb'";
    } else {
      text += fmt::format("; CAN {}", fmt::join(device.can, ", "));
    }
    found.push_back({device.address(), text});
  }
  found.insert(found.end(), in_dfu_mode.begin(), in_dfu_mode.end());
  return found;
}

std::vector<ReachableDevice> serial_ports(const fs::path& dev, std::span<const usb::UsbDevice> devices) {
  std::vector<ReachableDevice> ports;
  std::map<fs::path, bool> listed;
  const auto owner = [devices](const fs::path& port) -> std::string {
    const auto* const device =
        device::usb_device_of({.kind = device::DeviceAddress::Kind::serial, .path = port.string()}, devices);
    return device == nullptr ? "" : ", of " + device->address();
  };
  for (const fs::path& link : entries_of(dev / "serial" / "by-id")) {
    std::error_code dangling;
    const fs::path target = fs::canonical(link, dangling);
    if (dangling) continue;
    listed[target] = true;
    ports.push_back({"serial:" + link.string(), target.string() + owner(target)});
  }
  for (const fs::path& port : entries_of(dev)) {
    const std::string name = port.filename().string();
    if (!name.starts_with("ttyACM") && !name.starts_with("ttyUSB")) continue;
    if (!listed.contains(port)) ports.push_back({"serial:" + port.string(), "serial port" + owner(port)});
  }
  return ports;
}

std::vector<ReachableDevice> can_interfaces(const fs::path& net, std::span<const usb::UsbDevice> devices) {
  std::vector<ReachableDevice> interfaces;
  for (const fs::path& interface : entries_of(net)) {
    if (first_word(interface / "type") != "280") continue;
    const std::string name = interface.filename().string();
    const std::string flags = first_word(interface / "flags");
    const bool up = !flags.empty() && (std::strtoul(flags.c_str(), nullptr, 16) & 1U) != 0;
    std::string text = "CAN interface";
    if (const auto* const device =
            device::usb_device_of({.kind = device::DeviceAddress::Kind::can, .path = name}, devices))
      text += fmt::format(" of {}, {}", device->address(),
                          device->can.front() == name ? "the board alone" : "with the bus at its connector");
    text += up ? fmt::format(", up; 'kmax devices --can {}' looks for nodes on it", name)
               : fmt::format(", down: sudo ip link set {} up type can bitrate {}", name,
                             device::factory_default<std::uint32_t, "can.bit_rate">());
    interfaces.push_back({"can:" + name, text});
  }
  return interfaces;
}

std::vector<ReachableDevice> nodes_on(const std::string& bus, const std::vector<device::FoundNode>& nodes) {
  std::vector<ReachableDevice> devices;
  for (const device::FoundNode& node : nodes) {
    device::DeviceAddress address;
    address.kind = device::DeviceAddress::Kind::can;
    address.path = bus;
    address.node = node.node;
    std::string text = node.name.empty() ? "unnamed" : node.name;
    if (!node.device_type) text = "does not answer SDO";
    if (node.in_use) text = "in use by another program";
    if (node.identity) {
      const auto& [vendor, product, revision, serial] = *node.identity;
      text += fmt::format(", vendor {:#x}, product {:#x}, revision {:#x}, serial {:#x}", vendor, product,
                          revision, serial);
    }
    if (node.state) text += ", " + state_words(*node.state);
    const bool may_be_kmax = is_kmax(node) || node.in_use;
    if (!may_be_kmax) text = fmt::format("node {} on {}: not a Kmax device: ", node.node, bus) + text;
    devices.push_back({may_be_kmax ? device::text_of(address) : "", text});
  }
  return devices;
}

}  // namespace kmax::cli
