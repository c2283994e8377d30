#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <memory>
#include <string>

#include "host_tools/device/device_address.hpp"
#include "host_tools/kmax/board/board_services.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/flash/board_with_tools.hpp"
#include "tests/host_tools/flash/made_elf.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"
#include "tests/host_tools/lines/fake_gpio_lines.hpp"
#include "tests/host_tools/usb/made_usb_tree.hpp"

namespace kmax::cli {

/// The command line with GPIO lines, tools, USB and a device that are not real.
class BoardCommandLine : public CommandLineFixture {
 protected:
  BoardCommandLine() {
    unsetenv("KMAX_DEVICE");
    unsetenv("KMAX_LINES");
    setenv("XDG_CONFIG_HOME", board.folder.path().c_str(), 1);
    services.open_gpio = [this] { return gpio.open(); };
    services.sleep = [this](std::chrono::milliseconds) {
      if (at_sleep) at_sleep();
    };
    services.usb_devices = usb_tree.devices();
    services.usb_nodes = usb_tree.nodes();
    services.dev = usb_tree.dev();
    services.net = usb_tree.net();
    image = board.folder.write("image.elf", flash::made_elf(flash::made_image())).string();
  }
  ~BoardCommandLine() override { unsetenv("XDG_CONFIG_HOME"); }

  std::unique_ptr<device::Link> open_device(const std::string&, const device::Notice&) override {
    if (!device) throw device::LinkError("nobody answers");
    return std::make_unique<host_tools_test::FakeLink>(device);
  }
  void prepare(Context& context) override {
    context.board_services = std::make_shared<BoardServices>(services);
  }
  void configure(const std::string& text) {
    lines_file = board.folder.write("lines.toml", text).string();
    setenv("KMAX_LINES", lines_file.c_str(), 1);
  }
  void plug_in(const std::string& vendor, const std::string& product) {
    usb_tree.plug_in("1-1", vendor, product);
  }

  flash::BoardWithTools board;
  usb::MadeUsbTree usb_tree{board.folder};
  lines::FakeGpio gpio;
  BoardServices services;
  std::function<void()> at_sleep;
  std::shared_ptr<host_tools_test::FakeDevice> device;
  std::string image, lines_file;
};

}  // namespace kmax::cli
