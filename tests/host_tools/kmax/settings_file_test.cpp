#include "host_tools/kmax/settings_file.hpp"

#include <cstdlib>
#include <filesystem>

#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::settings_file_test {

class SettingsFile : public SimulatedCommandLine {
 protected:
  SettingsFile() {
    unsetenv("KMAX_DEVICE");
    std::filesystem::create_directory(in("kmax"));
  }
  ~SettingsFile() override { setenv("KMAX_DEVICE", "sim", 1); }
};

TEST_F(SettingsFile, NamesTheDeviceBehindOptionAndEnvironment) {
  folder.write("kmax/config.toml", "device = \"serial:/nowhere/file\"\n");
  expect_error({"save"}, failed, "/nowhere/file");
  setenv("KMAX_DEVICE", "serial:/nowhere/environment", 1);
  expect_error({"save"}, failed, "/nowhere/environment");
  expect_error({"save", "--device", "serial:/nowhere/option"}, failed, "/nowhere/option");
}

TEST_F(SettingsFile, WhatIsWrongInItIsSaid) {
  folder.write("kmax/config.toml", "devise = \"sim\"\n");
  expect_error({"state"}, wrong_usage, "there is no setting 'devise'; did you mean device?");
  folder.write("kmax/config.toml", "device = 5\n");
  expect_error({"state"}, wrong_usage, "device is not an address");
  folder.write("kmax/config.toml", "device =\n");
  expect_error({"state"}, wrong_usage, "config.toml:1:");
  folder.write("kmax/config.toml", "");
  EXPECT_EQ(kmax({"state"}), done) << said;
}

TEST_F(SettingsFile, IsWhereTheSpecificationSays) {
  EXPECT_EQ(settings_file(), folder / "kmax" / "config.toml");
  setenv("XDG_CONFIG_HOME", "relative", 1);
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(settings_file(), "/home/somebody/.config/kmax/config.toml");
  unsetenv("HOME");
  EXPECT_EQ(settings_file(), "");
}

}  // namespace kmax::cli::settings_file_test
