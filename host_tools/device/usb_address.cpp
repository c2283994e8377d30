#include "host_tools/device/usb_address.hpp"

#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <vector>

#include "host_tools/device/link.hpp"

namespace kmax::device {

using usb::UsbDevice;

namespace {
bool same_serial(const UsbDevice& device, const std::string& serial) {
  return strcasecmp(device.serial.c_str(), serial.c_str()) == 0;
}

/// Those that a usb address may mean.
std::vector<const UsbDevice*> meant_by(const DeviceAddress& address, std::span<const UsbDevice> devices) {
  std::vector<const UsbDevice*> found;
  for (const UsbDevice& device : devices) {
    if (device.is_kmax() && (address.path.empty() || same_serial(device, address.path)))
      found.push_back(&device);
  }
  return found;
}
}  // namespace

std::string usb_addresses(std::span<const UsbDevice> devices) {
  std::vector<std::string> addresses;
  for (const UsbDevice& device : devices) {
    if (device.is_kmax()) addresses.push_back(device.address());
  }
  return fmt::format("{}", fmt::join(addresses, ", "));
}

DeviceAddress serial_address_of(const DeviceAddress& usb, std::span<const UsbDevice> devices) {
  const auto fail = [&usb](const std::string& why) {
    throw LinkError(fmt::format("{}: {}", text_of(usb), why));
  };
  const auto found = meant_by(usb, devices);
  if (found.empty()) {
    const std::string others = usb_addresses(devices);
    if (!others.empty()) fail(fmt::format("no such device is on USB; there is {}", others));
    fail("no Kmax device is on USB; is the cable plugged in at both ends, and the board's own supply on?");
  }
  if (found.size() > 1)
    fail(fmt::format("several Kmax devices are on USB; name one: {}", usb_addresses(devices)));
  const UsbDevice& device = *found.front();
  if (device.terminals.empty())
    fail(
        fmt::format("it is at USB port {}, but has no serial port yet: plug it in again, or 'sudo modprobe "
                    "cdc_acm'",
                    device.port));
  DeviceAddress serial;
  serial.kind = DeviceAddress::Kind::serial;
  serial.path = "/dev/" + device.terminals.front();
  serial.unit = usb.unit;
  return serial;
}

const UsbDevice* usb_device_of(const DeviceAddress& address, std::span<const UsbDevice> devices) {
  const auto leads_to = [](const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  switch (address.kind) {
    case DeviceAddress::Kind::sim:
      return nullptr;
    case DeviceAddress::Kind::usb: {
      const auto found = meant_by(address, devices);
      return found.size() == 1 ? found.front() : nullptr;
    }
    case DeviceAddress::Kind::serial:
    case DeviceAddress::Kind::can:
      break;
  }
  // A port has several names: those below /dev/serial are links.
  std::error_code gone;
  const std::string port = std::filesystem::weakly_canonical(address.path, gone).filename();
  for (const UsbDevice& device : devices) {
    if (!device.is_kmax()) continue;
    if (address.kind == DeviceAddress::Kind::can ? leads_to(device.can, address.path)
                                                 : leads_to(device.terminals, port))
      return &device;
  }
  return nullptr;
}

}  // namespace kmax::device
