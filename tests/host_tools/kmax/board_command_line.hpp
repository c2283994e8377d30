#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <CLI/CLI.hpp>

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "host_tools/device/device_address.hpp"
#include "host_tools/kmax/board_services.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/flash/board_with_tools.hpp"
#include "tests/host_tools/flash/made_elf.hpp"
#include "tests/host_tools/lines/fake_gpio_lines.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli {

/// The commands for lines and flashing, with GPIO lines, tools, USB and a device that are not real. Errors
/// become exit codes as command_line.cpp makes them.
class BoardCommandLine : public testing::Test {
 protected:
  BoardCommandLine() {
    unsetenv("KMAX_DEVICE");
    unsetenv("KMAX_LINES");
    setenv("XDG_CONFIG_HOME", board.folder.path().c_str(), 1);
    std::filesystem::create_directory(board.folder / "usb");
    services.open_gpio = [this] { return gpio.open(); };
    services.sleep = [this](std::chrono::milliseconds) {
      if (at_sleep) at_sleep();
    };
    services.usb_devices = board.folder / "usb";
    image = board.folder.write("image.elf", flash::made_elf(flash::made_image())).string();
  }
  ~BoardCommandLine() override { unsetenv("XDG_CONFIG_HOME"); }

  int kmax(std::vector<std::string> arguments) {
    std::ostringstream out, messages;
    Context context(out, messages,
                    [this](const std::string&, const link::Notice&) -> std::unique_ptr<link::Link> {
                      if (!device) throw link::LinkError("nobody answers");
                      return std::make_unique<host_tools_test::FakeLink>(device);
                    });
    CLI::App app("test", "kmax");
    add_lines_commands(app, context, services);
    add_flash_command(app, context, services);
    const int code = outcome(app, context, std::move(arguments), messages);
    output = out.str();
    said = messages.str();
    return code;
  }
  Json document() {
    Json parsed = Json::parse(output, nullptr, false);
    EXPECT_FALSE(parsed.is_discarded()) << output;
    return parsed;
  }
  void configure(const std::string& text) {
    lines_file = board.folder.write("lines.toml", text).string();
    setenv("KMAX_LINES", lines_file.c_str(), 1);
  }
  void plug_in(const std::string& vendor, const std::string& product) {
    std::filesystem::create_directory(board.folder / "usb" / "1-1");
    board.folder.write("usb/1-1/idVendor", vendor + "\n");
    board.folder.write("usb/1-1/idProduct", product + "\n");
  }

  flash::BoardWithTools board;
  lines::FakeGpio gpio;
  BoardServices services;
  std::function<void()> at_sleep;
  std::shared_ptr<host_tools_test::FakeDevice> device;
  std::string image, lines_file, output, said;

 private:
  static int outcome(CLI::App& app, Context& context, std::vector<std::string> arguments,
                     std::ostringstream& messages) {
    try {
      std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
      app.parse(reversed);
    } catch (const CLI::ParseError& error) {
      return app.exit(error, messages, messages) == 0 ? done : wrong_usage;
    }
    try {
      return context.action();
    } catch (const UsageError& error) {
      messages << error.what();
      return wrong_usage;
    } catch (const std::exception& error) {
      messages << error.what();
      return failed;
    }
  }
};

}  // namespace kmax::cli
