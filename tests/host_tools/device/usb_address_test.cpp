#include "host_tools/device/usb_address.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/link.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::usb_address_test {

using host_tools_test::thrown_message;

usb::UsbDevice kmax_device(const std::string& serial, const std::string& port, const std::string& terminal) {
  usb::UsbDevice device{0x1209, 0x2323, serial, "Kmax", port};
  if (!terminal.empty()) device.terminals = {terminal};
  return device;
}

class UsbAddress : public testing::Test {
 protected:
  std::string found(const std::string& text) {
    return text_of(serial_address_of(parse_device_address(text), devices));
  }
  std::string complaint(const std::string& text) {
    return thrown_message<LinkError>([&] { found(text); });
  }
  std::string port_of(const std::string& text) {
    const auto* const device = usb_device_of(parse_device_address(text), devices);
    return device == nullptr ? "" : device->port;
  }

  usb::UsbDevice mouse{0x046D, 0xC077, "", "Logitech", "1-3"};
  usb::UsbDevice adapter{0x1209, 0x2323, "1F2E3D4C", "bytewerk", "1-4"};
  std::vector<usb::UsbDevice> devices{mouse, adapter, kmax_device("1F2E3D4C", "1-1", "ttyACM2")};
};

TEST_F(UsbAddress, TheOnlyDeviceNeedsNoName) {
  EXPECT_EQ(found("usb"), "serial:/dev/ttyACM2");
  EXPECT_EQ(found("usb?unit=7"), "serial:/dev/ttyACM2?unit=7");
  EXPECT_EQ(found("usb:1f2e3d4c"), "serial:/dev/ttyACM2") << "as people type it";
}

TEST_F(UsbAddress, WithoutOneTheCableIsAskedFor) {
  devices = {mouse, adapter};
  EXPECT_CONTAINS(complaint("usb"), "usb: no Kmax device is on USB; is the cable plugged in");
}

TEST_F(UsbAddress, OneThatIsNotThereIsNotReplacedByAnother) {
  EXPECT_CONTAINS(complaint("usb:5A6B7C8D"), "no such device is on USB; there is usb:1F2E3D4C");
  EXPECT_EQ(port_of("usb:5A6B7C8D"), "");
}

TEST_F(UsbAddress, OfSeveralOneMustBeNamed) {
  devices.push_back(kmax_device("5A6B7C8D", "1-2", "ttyACM0"));
  EXPECT_CONTAINS(complaint("usb"), "name one: usb:1F2E3D4C, usb:5A6B7C8D");
  EXPECT_EQ(found("usb:5A6B7C8D"), "serial:/dev/ttyACM0");
  EXPECT_EQ(port_of("usb"), "");
}

TEST_F(UsbAddress, WithoutADriverItSaysWhichIsMissing) {
  devices.back().terminals.clear();
  EXPECT_CONTAINS(complaint("usb"), "it is at USB port 1-1, but has no serial port yet");
  EXPECT_CONTAINS(complaint("usb"), "sudo modprobe cdc_acm");
}

TEST_F(UsbAddress, AnyAddressMayLeadToADeviceOnUsb) {
  devices.back().can = {"can3", "can4"};
  for (const char* text : {"usb", "usb:1F2E3D4C", "serial:/dev/ttyACM2", "can:can3", "can:can4?node=5"})
    EXPECT_EQ(port_of(text), "1-1") << text;
  for (const char* text : {"sim", "serial:/dev/ttyUSB0", "can:can0", "can:ttyACM2", "serial:can3"})
    EXPECT_EQ(port_of(text), "") << text;
}

}  // namespace kmax::device::usb_address_test
