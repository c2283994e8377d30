// kmax devices.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>

#include "host_tools/base/print.hpp"
#include "host_tools/kmax/board/board_services.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/device/reachable_devices.hpp"

namespace kmax::cli {

namespace {
void append(std::vector<ReachableDevice>& all, const std::vector<ReachableDevice>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

struct DevicesOptions {
  std::vector<std::string> buses;

  void declare(CLI::App& command) {
    command.add_option("--can", buses, "Look for nodes on this interface; more than once for several")
        ->type_name("IFACE");
  }
};

int run_devices(Context& context, const DevicesOptions& options) {
  const std::vector<std::string>& buses = options.buses;
  if (std::find(buses.begin(), buses.end(), "") != buses.end())
    throw UsageError("--can: the name of a CAN interface is needed, as in --can can0");
  std::vector<ReachableDevice> devices{{"sim", "a simulated device in this program"}};
  const BoardServices& services = board_services(context);
  const auto on_usb = usb::list_usb_devices(services.usb_devices);
  append(devices, usb_devices(on_usb, services.dev, services.may_open));
  append(devices, serial_ports(services.dev, on_usb));
  append(devices, can_interfaces(services.net, on_usb));
  int code = base::done;
  for (const std::string& bus : buses) {
    std::vector<ReachableDevice> nodes;
    try {
      nodes = nodes_on(bus, device::discover_nodes(bus));
    } catch (const device::LinkError& error) {
      // What else can be reached is still worth seeing.
      context.note(error.what());
      code = base::failed;
      continue;
    }
    if (nodes.empty())
      context.note(
          fmt::format("{}: no node answered; is the device powered, the bus terminated, and its "
                      "bit rate the device's can.bit_rate?",
                      bus));
    append(devices, nodes);
  }
  if (context.json) {
    Json list = Json::array();
    for (const ReachableDevice& device : devices)
      list.push_back({{"address", device.address.empty() ? Json(nullptr) : Json(device.address)},
                      {"description", device.description}});
    context.print({{"devices", list}});
    return code;
  }
  std::size_t width = 0;
  for (const ReachableDevice& device : devices) width = std::max(width, device.address.size());
  for (const ReachableDevice& device : devices)
    context.say(
        fmt::format("{:<{}}  {}", device.address.empty() ? "-" : device.address, width, device.description),
        std::min<std::size_t>(width + 2, 20));
  return code;
}
}  // namespace

void add_devices_command(CLI::App& app, Context& context) {
  add_command<DevicesOptions>(
      app, context,
      {"devices",
       "Lists what can be reached: simulated, on USB, serial ports, CAN interfaces and the nodes on them.",
       "  kmax devices\n  kmax devices --can can0     with the nodes on can0\n\n"
       "The first column is what --device takes. A device on USB comes with what to do where its port or\n"
       "its CAN interfaces cannot be used yet. Serial ports are listed, not opened. Nodes are asked for\n"
       "their identity over SDO, which takes a second for each bus."},
      Takes::nothing, run_devices);
}

}  // namespace kmax::cli
