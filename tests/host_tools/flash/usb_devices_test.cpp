#include "host_tools/flash/usb_devices.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::flash::usb_devices_test {

TEST(UsbDevices, AreReadFromTheKernelsFiles) {
  host_tools_test::TemporaryFolder folder;
  for (const char* name : {"usb1", "1-1", "1-1:1.0", "1-2"}) std::filesystem::create_directory(folder / name);
  folder.write("usb1/idVendor", "1d6b\n");
  folder.write("usb1/idProduct", "0002\n");
  folder.write("1-1/idVendor", "0483\n");
  folder.write("1-1/idProduct", "df11\n");
  folder.write("1-1/serial", "357236713033\n");
  folder.write("1-2/idVendor", "0483x\n");
  folder.write("1-2/idProduct", "374b\n");
  const auto found = list_usb_devices(folder.path());
  ASSERT_EQ(found.size(), 2u);
  for (const UsbDevice& device : found) {
    EXPECT_FALSE(device.is_st_link());
    EXPECT_EQ(device.is_dfu(), device.vendor == 0x0483);
    if (device.is_dfu()) {
      EXPECT_EQ(device.serial, "357236713033");
    }
  }
}

TEST(UsbDevices, WithoutUsbThereAreNone) {
  EXPECT_TRUE(list_usb_devices("/no/such/folder").empty());
}

TEST(UsbDevices, StLinksAreKnownByVendorAndProduct) {
  EXPECT_TRUE((UsbDevice{0x0483, 0x3748, ""}.is_st_link()));
  EXPECT_TRUE((UsbDevice{0x0483, 0x3754, ""}.is_st_link()));
  EXPECT_FALSE((UsbDevice{0x0483, 0xDF11, ""}.is_st_link()));
  EXPECT_FALSE((UsbDevice{0x0484, 0x3748, ""}.is_st_link()));
}

}  // namespace kmax::flash::usb_devices_test
