#include "host_tools/device/device_address.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdlib>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::device_address_test {

using host_tools_test::thrown_message;
using Kind = DeviceAddress::Kind;

std::string complaint(const std::string& text) {
  return thrown_message<AddressError>([&] { parse_device_address(text); });
}

TEST(DeviceAddress, ItsForms) {
  EXPECT_EQ(parse_device_address("sim").kind, Kind::sim);
  const auto serial = parse_device_address("serial:/dev/ttyUSB0?unit=17&baud=9600");
  EXPECT_EQ(serial.kind, Kind::serial);
  EXPECT_EQ(serial.path, "/dev/ttyUSB0");
  EXPECT_EQ(serial.unit, 17);
  EXPECT_EQ(serial.baud_rate, 9600u);
  const auto can = parse_device_address("can:can0?node=5");
  EXPECT_EQ(can.kind, Kind::can);
  EXPECT_EQ(can.path, "can0");
  EXPECT_EQ(can.node, 5);
  const auto usb = parse_device_address("usb:1F2E3D4C?unit=17");
  EXPECT_EQ(usb.kind, Kind::usb);
  EXPECT_EQ(usb.path, "1F2E3D4C");
  EXPECT_EQ(usb.unit, 17);
}

TEST(DeviceAddress, TheOnlyDeviceOnUsbNeedsNoName) {
  for (const std::string text : {"usb", "usb?unit=17"}) {
    const auto address = parse_device_address(text);
    EXPECT_EQ(address.kind, Kind::usb);
    EXPECT_EQ(address.path, "");
    EXPECT_EQ(text_of(address), text);
  }
  EXPECT_CONTAINS(complaint("usb:"),
                  "the serial number is missing, as in usb:1F2E3D4C; write usb for the only");
  EXPECT_CONTAINS(complaint("usb:?unit=1"), "the serial number is missing");
  EXPECT_CONTAINS(complaint("usb?"), "no option ''");
  EXPECT_CONTAINS(complaint("usb?baud=9600"), "options are unit");
  EXPECT_CONTAINS(complaint("usb?unit=0"), "1 .. 247");
  EXPECT_CONTAINS(complaint("usbx"), "allowed are");
  EXPECT_CONTAINS(complaint("serial"), "allowed are");
  EXPECT_CONTAINS(complaint("can?node=1"), "allowed are");
  EXPECT_CONTAINS(complaint("sim?x:y"), "no options");
}

TEST(DeviceAddress, ABusMayBeAPath) {
  for (const std::string path : {"./bus", "/run/user/1000/bus:1", "/tmp/a=b&c"}) {
    const auto address = parse_device_address("can:" + path + "?node=127");
    EXPECT_EQ(address.path, path);
    EXPECT_EQ(address.node, 127);
    EXPECT_EQ(text_of(address), "can:" + path + "?node=127");
    EXPECT_EQ(parse_device_address("can:" + path).node, 1);
  }
}

TEST(DeviceAddress, LeftOutOptionsAreTheFactorys) {
  const auto address = parse_device_address("serial:/tmp/link");
  EXPECT_EQ(address.unit, 1);
  EXPECT_EQ(address.baud_rate, 115200u);
  EXPECT_EQ(text_of(address), "serial:/tmp/link");
}

TEST(DeviceAddress, ErrorsSayWhatIsAllowed) {
  EXPECT_CONTAINS(complaint("/dev/ttyUSB0"), "write serial:/dev/ttyUSB0");
  EXPECT_CONTAINS(complaint("tcp:host"), "allowed are sim, usb[:SERIAL], serial:PATH");
  EXPECT_CONTAINS(complaint(""), "empty");
  EXPECT_CONTAINS(complaint("Sim"), "allowed are");
  EXPECT_CONTAINS(complaint("sim:x"), "no options");
  EXPECT_CONTAINS(complaint("serial:"), "port is missing");
  EXPECT_CONTAINS(complaint("serial:?unit=1"), "port is missing");
  EXPECT_CONTAINS(complaint("can:"), "interface is missing");
  EXPECT_CONTAINS(complaint("serial:/dev/a?speed=9600"), "options are unit, baud");
  EXPECT_CONTAINS(complaint("serial:/dev/a?node=1"), "options are unit, baud");
  EXPECT_CONTAINS(complaint("can:can0?baud=9600"), "options are node");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=0"), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=248"), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=4294967297"), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=-1"), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=1x"), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit="), "1 .. 247");
  EXPECT_CONTAINS(complaint("serial:/dev/a?baud=12345"), "9600, 19200");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit"), "needs a value");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=1&unit=2"), "twice");
  EXPECT_CONTAINS(complaint("serial:/dev/a?unit=1&"), "no option ''");
  EXPECT_CONTAINS(complaint("serial:/dev/a?"), "no option ''");
  EXPECT_CONTAINS(complaint("can:can0?node=128"), "1 .. 127");
}

RC_GTEST_PROP(DeviceAddress, ItsTextGivesItBack, ()) {
  DeviceAddress address{.kind = *rc::gen::element(Kind::serial, Kind::can, Kind::usb)};
  address.path = *rc::gen::container<std::string>(rc::gen::element('a', '/', ':', '.', '-', '=', '&'));
  if (address.kind != Kind::usb && address.path.empty()) address.path = "a";
  if (address.kind != Kind::can) address.unit = *rc::gen::inRange<std::uint8_t>(1, 248);
  if (address.kind == Kind::serial) address.baud_rate = *rc::gen::element(9600u, 115200u, 921600u);
  if (address.kind == Kind::can) address.node = *rc::gen::inRange<std::uint8_t>(1, 128);
  RC_ASSERT(parse_device_address(text_of(address)) == address);
}

TEST(DefaultDeviceAddress, ComesFromTheEnvironment) {
  setenv("KMAX_DEVICE", "serial:/dev/x", 1);
  EXPECT_EQ(device_address_of_environment(), "serial:/dev/x");
  setenv("KMAX_DEVICE", "", 1);
  EXPECT_EQ(device_address_of_environment(), std::nullopt);
  unsetenv("KMAX_DEVICE");
  EXPECT_EQ(device_address_of_environment(), std::nullopt);
}

}  // namespace kmax::device::device_address_test
