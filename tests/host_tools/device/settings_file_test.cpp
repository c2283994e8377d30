#include "host_tools/device/settings_file.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "host_tools/device/device_address.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::settings_file_test {

class SettingsFile : public testing::Test {
 protected:
  SettingsFile() {
    unsetenv("KMAX_DEVICE");
    setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
    std::filesystem::create_directory(folder / "kmax");
  }
  ~SettingsFile() override {
    unsetenv("KMAX_DEVICE");
    unsetenv("XDG_CONFIG_HOME");
  }
  std::string complaint(const std::string& text) {
    folder.write("kmax/config.toml", text);
    return host_tools_test::thrown_message<AddressError>([] { default_device_address(); });
  }

  host_tools_test::TemporaryFolder folder;
};

TEST_F(SettingsFile, NamesTheDeviceBehindTheEnvironment) {
  EXPECT_EQ(default_device_address(), std::nullopt);
  folder.write("kmax/config.toml", "device = \"serial:/dev/file\"\n");
  EXPECT_EQ(default_device_address(), "serial:/dev/file");
  setenv("KMAX_DEVICE", "serial:/dev/environment", 1);
  EXPECT_EQ(default_device_address(), "serial:/dev/environment");
}

TEST_F(SettingsFile, WhatIsWrongInItIsSaid) {
  EXPECT_CONTAINS(complaint("devise = \"sim\"\n"), "there is no setting 'devise'; did you mean device?");
  EXPECT_CONTAINS(complaint("device = 5\n"), "device is not an address");
  EXPECT_CONTAINS(complaint("device =\n"), "config.toml:1:");
  folder.write("kmax/config.toml", "");
  EXPECT_EQ(default_device_address(), std::nullopt);
}

TEST_F(SettingsFile, IsWhereTheSpecificationSays) {
  EXPECT_EQ(settings_file(), folder / "kmax" / "config.toml");
  setenv("XDG_CONFIG_HOME", "relative", 1);
  const std::string home = std::getenv("HOME") == nullptr ? "" : std::getenv("HOME");
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(settings_file(), "/home/somebody/.config/kmax/config.toml");
  unsetenv("HOME");
  EXPECT_EQ(settings_file(), "");
  setenv("HOME", home.c_str(), 1);
}

}  // namespace kmax::device::settings_file_test
