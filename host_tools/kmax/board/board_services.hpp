#pragma once

#include <CLI/App.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "host_tools/flash/board_profile.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/lines/board_reset.hpp"
#include "host_tools/lines/gpio_lines.hpp"
#include "host_tools/lines/lines_config.hpp"
#include "host_tools/usb/boot_loader_request.hpp"
#include "host_tools/usb/usb_devices.hpp"

// What the commands for GPIO lines, flashing and discovery reach of this computer; tests put their own in.

namespace kmax::cli {

struct BoardServices {
  std::function<std::unique_ptr<lines::GpioLines>()> open_gpio = lines::kernel_gpio_lines;
  lines::Sleep sleep = lines::sleep_for;
  std::filesystem::path usb_devices = usb::kernel_usb_devices;
  std::filesystem::path usb_nodes = usb::kernel_usb_nodes;
  std::filesystem::path dev = "/dev";
  std::filesystem::path net = "/sys/class/net";
  std::function<bool(const std::filesystem::path&)> may_open = usb::may_open;
  std::function<void(const usb::UsbDevice&, const std::filesystem::path& nodes)> restart_into_boot_loader =
      usb::restart_into_boot_loader;
};

/// Those of the context, or else this computer's own.
const BoardServices& board_services(const Context& context);

/// Adds --lines.
void add_lines_option(CLI::App& command, std::string& file);

/// lines::find_lines_config(); what is wrong with the file is wrong usage.
lines::LinesConfig read_lines_config(const std::string& file);

/// The board of --board, or of the configuration, or the ODrive. UsageError.
const flash::BoardProfile& chosen_board(const std::string& option, const lines::LinesConfig& config);

}  // namespace kmax::cli
