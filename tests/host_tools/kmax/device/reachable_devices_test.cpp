#include "host_tools/kmax/device/reachable_devices.hpp"

#include <gtest/gtest.h>

#include "firmware/application.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

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

TEST(ReachableDevices, NodesThatAreKmaxDevicesHaveAnAddress) {
  link::FoundNode kmax{.node = 5, .state = 127, .device_type = firmware::device_type_of_several_axes};
  kmax.identity = {0, firmware::product_code, 0x100, 0x1234};
  kmax.name = "Kmax";
  link::FoundNode other{.node = 7, .device_type = 0x20192};
  link::FoundNode silent{.node = 9, .state = 4};
  link::FoundNode busy{.node = 11};
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
