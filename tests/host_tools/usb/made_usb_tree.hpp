#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::usb {

/// The kernel's files of USB devices, made up: below `folder`/usb what is plugged in, below `folder`/dev its
/// nodes and ports, below `folder`/net its CAN interfaces.
class MadeUsbTree {
 public:
  explicit MadeUsbTree(const host_tools_test::TemporaryFolder& folder) : folder_(folder) {
    for (const char* name : {"usb", "net", "dev/bus/usb/003"})
      std::filesystem::create_directories(folder / name);
  }

  std::filesystem::path devices() const { return folder_ / "usb"; }
  std::filesystem::path dev() const { return folder_ / "dev"; }
  std::filesystem::path nodes() const { return folder_ / "dev/bus/usb"; }
  std::filesystem::path net() const { return folder_ / "net"; }

  void plug_in(const std::string& port, const std::string& vendor, const std::string& product) {
    const std::string at = "usb/" + port + "/";
    std::filesystem::create_directories(folder_ / at);
    folder_.write(at + "idVendor", vendor + "\n");
    folder_.write(at + "idProduct", product + "\n");
    folder_.write(at + "busnum", "3\n");
    folder_.write(at + "devnum", fmt::format("{}\n", ++number_));
    folder_.write(fmt::format("dev/bus/usb/003/{:03}", number_), "");
  }
  /// No driver has anything of it yet.
  void plug_in_kmax(const std::string& port, const std::string& serial) {
    plug_in(port, "1209", "2323");
    const std::string at = "usb/" + port + "/";
    folder_.write(at + "manufacturer", "Kmax\n");
    folder_.write(at + "serial", serial + "\n");
    for (const char* interface : {":1.0", ":1.1", ":1.2"})
      std::filesystem::create_directories(folder_ / (at + port + interface));
  }
  void bind_serial(const std::string& port, const std::string& terminal) {
    std::filesystem::create_directories(folder_ / fmt::format("usb/{0}/{0}:1.1/tty/{1}", port, terminal));
    folder_.write("dev/" + terminal, "");
  }
  void bind_can(const std::string& port, const std::string& interface, int channel, bool up) {
    const std::string of_usb = fmt::format("usb/{0}/{0}:1.0/net/{1}", port, interface);
    for (const std::string& place : {of_usb, "net/" + interface}) {
      std::filesystem::create_directories(folder_ / place);
      folder_.write(place + "/dev_id", fmt::format("0x{:x}\n", channel));
      folder_.write(place + "/type", "280\n");
      folder_.write(place + "/flags", up ? "0x40081\n" : "0x40080\n");
    }
  }
  void pull_out(const std::string& port) { std::filesystem::remove_all(devices() / port); }

 private:
  const host_tools_test::TemporaryFolder& folder_;
  int number_ = 0;
};

}  // namespace kmax::usb
