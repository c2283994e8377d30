#include "host_tools/kmax/device/reachable_devices.hpp"

#include <gtest/gtest.h>

#include "firmware/application.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/host_tools/usb/made_usb_tree.hpp"

namespace kmax::cli::reachable_devices_test {

namespace fs = std::filesystem;

TEST(ReachableDevices, SerialPortsByTheNameThatStays) {
  host_tools_test::TemporaryFolder dev;
  for (const char* name : {"ttyACM0", "ttyUSB1", "ttyS0", "null"}) dev.write(name, "");
  fs::create_directories(dev / "serial/by-id");
  fs::create_symlink("../../ttyACM0", dev / "serial/by-id/usb-probe");
  fs::create_symlink("../../ttyACM9", dev / "serial/by-id/usb-unplugged");
  const auto ports = serial_ports(fs::canonical(dev.path()));
  ASSERT_EQ(ports.size(), 2u);
  EXPECT_TRUE(ports[0].address.ends_with("/serial/by-id/usb-probe")) << ports[0].address;
  EXPECT_TRUE(ports[0].address.starts_with("serial:/"));
  EXPECT_TRUE(ports[0].description.ends_with("/ttyACM0"));
  EXPECT_TRUE(ports[1].address.ends_with("/ttyUSB1"));
}

TEST(ReachableDevices, AComputerWithoutPortsHasNone) {
  EXPECT_TRUE(serial_ports("/no/such/folder").empty());
  EXPECT_TRUE(can_interfaces("/no/such/folder").empty());
}

TEST(ReachableDevices, CanInterfacesAreThoseOfTheKernelsType) {
  host_tools_test::TemporaryFolder net;
  for (const char* name : {"can0", "can1", "eth0"}) fs::create_directories(net / name);
  net.write("can0/type", "280\n");
  net.write("can0/flags", "0x40081\n");
  net.write("can1/type", "280\n");
  net.write("can1/flags", "0x40080\n");
  net.write("eth0/type", "1\n");
  const auto interfaces = can_interfaces(net.path());
  ASSERT_EQ(interfaces.size(), 2u);
  EXPECT_EQ(interfaces[0].address, "can:can0");
  EXPECT_CONTAINS(interfaces[0].description, "up; 'kmax devices --can can0'");
  EXPECT_CONTAINS(interfaces[1].description, "down: sudo ip link set can1 up type can bitrate 1000000");
}

TEST(ReachableDevices, OnUsbWithAllThatItOffers) {
  host_tools_test::TemporaryFolder folder;
  usb::MadeUsbTree tree(folder);
  tree.plug_in("1-3", "046d", "c077");
  tree.plug_in_kmax("1-1", "1F2E3D4C");
  tree.bind_serial("1-1", "ttyACM0");
  tree.bind_can("1-1", "can0", 0, true);
  tree.bind_can("1-1", "can1", 1, false);
  folder.write("dev/ttyACM5", "");
  const auto devices = usb::list_usb_devices(tree.devices());
  const auto found = usb_devices(devices, "/dev", [](const fs::path&) { return true; });
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].address, "usb:1F2E3D4C");
  EXPECT_EQ(found[0].description, "Kmax at USB port 1-1: serial port /dev/ttyACM0; CAN can0, can1");
  const auto ports = serial_ports(tree.dev(), devices);
  ASSERT_EQ(ports.size(), 2u);
  EXPECT_EQ(ports[0].description, "serial port, of usb:1F2E3D4C");
  EXPECT_EQ(ports[1].description, "serial port");
  const auto interfaces = can_interfaces(tree.net(), devices);
  ASSERT_EQ(interfaces.size(), 2u);
  EXPECT_EQ(
      interfaces[0].description,
      "CAN interface of usb:1F2E3D4C, the board alone, up; 'kmax devices --can can0' looks for nodes on it");
  EXPECT_EQ(
      interfaces[1].description,
      "CAN interface of usb:1F2E3D4C, with the bus at its connector, down: sudo ip link set can1 up type can "
      "bitrate 1000000");
}

TEST(ReachableDevices, OnUsbWithWhatIsMissingAndHowToGetIt) {
  host_tools_test::TemporaryFolder folder;
  usb::MadeUsbTree tree(folder);
  tree.plug_in_kmax("1-1", "1F2E3D4C");
  tree.plug_in_kmax("1-2", "5A6B7C8D");
  tree.bind_serial("1-2", "ttyACM0");
  tree.plug_in("1-4", "0483", "df11");
  const auto found = usb_devices(usb::list_usb_devices(tree.devices()), "/dev", [](const fs::path& file) {
    EXPECT_EQ(file, "/dev/ttyACM0");
    return false;
  });
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].address, "usb:1F2E3D4C");
  EXPECT_CONTAINS(found[0].description, "no serial port: plug it in again, or 'sudo modprobe cdc_acm'");
  EXPECT_CONTAINS(found[0].description, "no CAN interfaces: 'sudo modprobe gs_usb'");
  EXPECT_EQ(found[1].address, "usb:5A6B7C8D");
  EXPECT_CONTAINS(found[1].description,
                  "serial port /dev/ttyACM0, which you may not open: install the udev rules");
  EXPECT_EQ(found[2].address, "");
  EXPECT_EQ(found[2].description,
            "an STM32 in DFU mode at USB port 1-4; 'kmax flash' writes firmware into it");
}

TEST(ReachableDevices, NodesThatAreKmaxDevicesHaveAnAddress) {
  device::FoundNode kmax{.node = 5, .state = 127, .device_type = firmware::device_type_of_several_axes};
  kmax.identity = {0, firmware::product_code, 0x100, 0x1234};
  kmax.name = "Kmax";
  device::FoundNode other{.node = 7, .device_type = 0x20192};
  device::FoundNode silent{.node = 9, .state = 4};
  device::FoundNode busy{.node = 11};
  busy.in_use = true;
  const auto devices = nodes_on("can0", {kmax, other, silent, busy});
  ASSERT_EQ(devices.size(), 4u);
  EXPECT_EQ(devices[0].address, "can:can0?node=5");
  EXPECT_EQ(devices[0].description,
            "Kmax, vendor 0x0, product 0x1, revision 0x100, serial 0x1234, pre-operational");
  EXPECT_EQ(devices[1].address, "");
  EXPECT_CONTAINS(devices[1].description, "node 7 on can0: not a Kmax device");
  EXPECT_EQ(devices[2].description, "node 9 on can0: not a Kmax device: does not answer SDO, stopped");
  EXPECT_EQ(devices[3].address, "can:can0?node=11");
  EXPECT_EQ(devices[3].description, "in use by another program");
}

}  // namespace kmax::cli::reachable_devices_test
