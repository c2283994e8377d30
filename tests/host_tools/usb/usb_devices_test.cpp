#include "host_tools/usb/usb_devices.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "firmware/usb/descriptors.hpp"
#include "tests/host_tools/usb/made_usb_tree.hpp"

namespace kmax::usb::usb_devices_test {

using Names = std::vector<std::string>;

class UsbDevices : public testing::Test {
 protected:
  std::vector<UsbDevice> listed() const { return list_usb_devices(tree.devices()); }

  host_tools_test::TemporaryFolder folder;
  MadeUsbTree tree{folder};
};

TEST_F(UsbDevices, AreReadFromTheKernelsFiles) {
  tree.plug_in("usb1", "1d6b", "0002");
  tree.plug_in("1-1", "0483", "df11");
  folder.write("usb/1-1/serial", "357236713033\n");
  tree.plug_in("1-2", "0483x", "374b");
  std::filesystem::create_directory(tree.devices() / "1-1:1.0");
  const auto found = listed();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].port, "1-1");
  EXPECT_TRUE(found[0].is_dfu());
  EXPECT_FALSE(found[0].is_st_link());
  EXPECT_EQ(found[0].serial, "357236713033");
  EXPECT_EQ(found[0].node(), "003/002");
  EXPECT_FALSE(found[1].is_dfu());
}

TEST_F(UsbDevices, WithoutUsbThereAreNone) {
  EXPECT_TRUE(list_usb_devices("/no/such/folder").empty());
}

TEST_F(UsbDevices, StLinksAreKnownByVendorAndProduct) {
  EXPECT_TRUE((UsbDevice{0x0483, 0x3748, ""}.is_st_link()));
  EXPECT_TRUE((UsbDevice{0x0483, 0x3754, ""}.is_st_link()));
  EXPECT_FALSE((UsbDevice{0x0483, 0xDF11, ""}.is_st_link()));
  EXPECT_FALSE((UsbDevice{0x0484, 0x3748, ""}.is_st_link()));
}

TEST_F(UsbDevices, AKmaxDeviceHasWhatItsDriversMade) {
  tree.plug_in_kmax("1-2.4", "1F2E3D4C");
  tree.bind_serial("1-2.4", "ttyACM3");
  tree.bind_can("1-2.4", "can7", 0, true);
  tree.bind_can("1-2.4", "can2", 1, false);
  const auto found = listed();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].is_kmax());
  EXPECT_EQ(found[0].address(), "usb:1F2E3D4C");
  EXPECT_EQ(found[0].terminals, Names{"ttyACM3"});
  EXPECT_EQ(found[0].can, (Names{"can7", "can2"})) << "in the order of the channels, not of the names";
}

TEST_F(UsbDevices, AKmaxDeviceWithoutDriversHasNothing) {
  tree.plug_in_kmax("1-1", "1F2E3D4C");
  EXPECT_TRUE(listed()[0].is_kmax());
  EXPECT_TRUE(listed()[0].terminals.empty());
  EXPECT_TRUE(listed()[0].can.empty());
}

TEST_F(UsbDevices, AnotherCanAdapterOfTheSameNumbersIsNone) {
  tree.plug_in_kmax("1-1", "0011");
  folder.write("usb/1-1/manufacturer", "bytewerk\n");
  EXPECT_FALSE(listed()[0].is_kmax());
  std::filesystem::remove(tree.devices() / "1-1/manufacturer");
  EXPECT_FALSE(listed()[0].is_kmax());
}

TEST_F(UsbDevices, AreInTheOrderOfTheirPorts) {
  for (const char* port : {"2-1", "1-3", "1-1.2"}) tree.plug_in_kmax(port, port);
  Names ports;
  for (const UsbDevice& device : listed()) ports.push_back(device.port);
  EXPECT_EQ(ports, (Names{"1-1.2", "1-3", "2-1"}));
}

TEST_F(UsbDevices, FilesThatAreEmptyOrBrokenAreNoNumbers) {
  tree.plug_in_kmax("1-1", "");
  folder.write("usb/1-1/busnum", "three\n");
  folder.write("usb/1-1/devnum", "");
  tree.bind_can("1-1", "can1", 1, true);
  tree.bind_can("1-1", "can0", 0, true);
  folder.write("usb/1-1/1-1:1.0/net/can0/dev_id", "\n");
  ASSERT_EQ(listed().size(), 1u);
  EXPECT_EQ(listed()[0].node(), "000/000");
  EXPECT_EQ(listed()[0].address(), "usb");
  EXPECT_EQ(listed()[0].can, (Names{"can0", "can1"}));
}

TEST_F(UsbDevices, MayBeOpenedOrNot) {
  EXPECT_TRUE(may_open(folder.write("port", "")));
  EXPECT_FALSE(may_open(folder / "none"));
  if (geteuid() == 0) return;
  std::filesystem::permissions(folder / "port", std::filesystem::perms::owner_read);
  EXPECT_FALSE(may_open(folder / "port"));
}

}  // namespace kmax::usb::usb_devices_test
