#include "host_tools/device/sim/open_link.hpp"

#include <fmt/format.h>

#include "host_tools/device/can/can_link.hpp"
#include "host_tools/device/serial/serial_link.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/device/usb_address.hpp"

namespace kmax::device {

std::unique_ptr<Link> open_link(const DeviceAddress& address, const Notice& notice) {
  switch (address.kind) {
    case DeviceAddress::Kind::sim:
      return make_sim_link();
    case DeviceAddress::Kind::serial:
      return std::make_unique<SerialLink>(address, notice);
    case DeviceAddress::Kind::can:
      return std::make_unique<CanLink>(address, notice);
    case DeviceAddress::Kind::usb:
      return std::make_unique<SerialLink>(serial_address_of(address, usb::list_usb_devices()), notice);
  }
  throw AddressError(fmt::format("{}: no such kind of device", text_of(address)));
}

}  // namespace kmax::device
