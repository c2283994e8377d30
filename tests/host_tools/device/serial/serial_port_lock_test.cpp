#include "host_tools/device/serial/serial_port_lock.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <optional>

#include "host_tools/device/serial/serial_link.hpp"
#include "tests/host_tools/device/serial/pty_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::serial_port_lock_test {

using host_tools_test::PtyDevice;
using host_tools_test::thrown_message;

TEST(SerialPortLock, ASecondProgramWaitsAndThenGivesUpNamingThePort) {
  PtyDevice device;
  const SerialPortLock first(device.path(), {});
  std::vector<std::string> notices;
  const auto message = thrown_message<LinkError>(
      [&] { SerialPortLock(device.path(), [&](const std::string& text) { notices.push_back(text); }); });
  EXPECT_CONTAINS(message, device.path());
  EXPECT_CONTAINS(message, "in use by another program");
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_CONTAINS(notices[0], "waiting");
}

TEST(SerialPortLock, ASymbolicLinkIsTheSamePort) {
  PtyDevice device;
  const std::string name = testing::TempDir() + "kmax_port_link_" + std::to_string(getpid());
  ASSERT_EQ(symlink(device.path().c_str(), name.c_str()), 0);
  const SerialPortLock first(device.path(), {});
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { SerialPortLock(name, {}); }), "in use");
  unlink(name.c_str());
}

TEST(SerialPortLock, TheSecondGetsThePortWhenTheFirstIsDone) {
  PtyDevice device;
  std::optional<SerialPortLock> first;
  first.emplace(device.path(), Notice{});
  EXPECT_NO_THROW(SerialPortLock(device.path(), [&](const std::string&) { first.reset(); }));
}

TEST(SerialPortLock, TwoLinksDoNotMixTheirRequests) {
  PtyDevice device;
  const auto address = parse_device_address("serial:" + device.path());
  const SerialLink first(address);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { SerialLink second(address); }), "in use");
}

TEST(SerialPortLock, WhatIsNoPortIsNamed) {
  EXPECT_CONTAINS(thrown_message<LinkError>([] { SerialPortLock("/dev/null", {}); }), "not a serial port");
  EXPECT_CONTAINS(thrown_message<LinkError>([] { SerialPortLock("/no/such/port", {}); }), "no such port");
  EXPECT_CONTAINS(thrown_message<LinkError>([] { SerialPortLock("/tmp", {}); }), "/tmp");
}

TEST(SerialPortLock, MissingPermissionNamesTheGroup) {
  if (geteuid() == 0) GTEST_SKIP() << "the superuser may open everything";
  PtyDevice device;
  ASSERT_EQ(chmod(device.path().c_str(), 0), 0);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { SerialPortLock(device.path(), {}); }), "dialout");
}

}  // namespace kmax::device::serial_port_lock_test
