#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "host_tools/base/exit_code.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/json/json.hpp"

namespace kmax::cli {

using json::Json;

struct BoardServices;

/// Wrong usage that only a command itself can find. Becomes exit code 2.
class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// What every command works with: where it writes, how it reaches a device, and the options all commands
/// share. Results go to `out`; with --json that is exactly one document (print()). Everything said to the
/// user on the way goes to note().
class Context {
 public:
  using Opener =
      std::function<std::unique_ptr<device::Link>(const std::string& address, const device::Notice&)>;

  Context(std::ostream& out_stream, std::ostream& messages, Opener opener)
      : out(out_stream), messages_(messages), opener_(std::move(opener)) {}

  /// Opens the named device, or the simulated one, and checks that it is a Kmax device of this release.
  device::Device connect();
  /// The same for a command that changes the device. UsageError where none is named: the simulated one lives
  /// for that command only and keeps nothing of it.
  device::Device connect_to_change();
  /// The link alone.
  std::unique_ptr<device::Link> open_link();

  /// One line on the messages' stream.
  void note(const std::string& text);

  /// Columns of the terminal that `out` is, now, 40 at least; 0 for anything else: then lines are as long as
  /// they are.
  std::size_t width() const;
  /// How wide a text is best written to `out`: as the terminal, at most 120; 80 for a file or a pipe.
  std::size_t columns() const { return width() == 0 ? 80 : std::min<std::size_t>(width(), 120); }
  /// A line of the result: on a terminal in lines that fit, all but the first of them indented.
  void say(const std::string& text, std::size_t indent = 2);

  /// For what a line at a time cannot show (Progress).
  std::ostream& messages() { return messages_; }

  /// Arguments and files may hold bytes that are no UTF-8, which JSON is: U+FFFD stands for them.
  void print(const Json& document) {
    out << document.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  }

  /// --axis, 0 without it.
  std::size_t axis() const { return axis_option.value_or(0); }
  /// --axis, or every axis: looking at and stopping one axis too many harms nobody.
  std::vector<std::size_t> axes() const;
  /// The address that the user named: --device, else KMAX_DEVICE, else the settings file's. UsageError: that
  /// is wrong.
  std::optional<std::string> named_device() const;
  /// The address in use.
  std::string device_address() const { return named_device().value_or("sim"); }
  bool simulated() const { return device_address() == "sim"; }

  std::ostream& out;

  // Set by the command line.
  bool json = false;
  /// In the place of the terminal's, for tests.
  std::optional<std::size_t> fixed_width;
  std::string device_option;
  std::optional<std::size_t> axis_option;
  /// How a CAN bus is reached, besides the link to one device on it.
  std::function<std::unique_ptr<device::CanPort>(const std::string& bus, const device::CanPortOptions&)>
      open_bus = device::open_can_port;
  /// How the board is reached besides its links (board_services.hpp); null: as this computer does.
  std::shared_ptr<const BoardServices> board_services;
  std::function<int()> action;  ///< what the chosen command does; returns an exit code

 private:
  std::ostream& messages_;
  Opener opener_;
};

}  // namespace kmax::cli
