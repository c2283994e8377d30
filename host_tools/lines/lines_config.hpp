#pragma once

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "host_tools/lines/gpio_lines.hpp"

// Which GPIO line is wired to what, and which board it is, in a TOML file:
//
//   [board]
//   kind = "odrive_v3"           as 'kmax flash --board' takes it; default odrive_v3
//   serial_port = "/dev/ttyUSB0" port of the ROM bootloader, for boards that have one
//
//   [lines.reset]                also boot0, emergency_stop, fault, healthy, swdio, swclk
//   chip = "gpiochip0"           name, label or path; not needed if `name` is unique
//   line = 17                    its number on the chip, or
//   name = "NRST"                its name
//   active = "low"               or "high"; default by role (gpio_lines.hpp)
//   drive = "open_drain"         or "push_pull", "open_source"; default by role
//   bias = "pull_up"             or "pull_down", "disabled"; default: left as it is
//
// Refused with LinesConfigError, whose text begins with file:line:column: syntax errors, unknown keys, wrong
// types and values, a line without an address, one line in two roles.

namespace kmax::lines {

class LinesConfigError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

struct LinesConfig {
  std::string file;  ///< where it came from; empty: there is none
  std::string board_kind;
  std::string serial_port;
  std::map<LineRole, LineSettings> lines;

  const LineSettings* find(LineRole role) const {
    const auto found = lines.find(role);
    return found == lines.end() ? nullptr : &found->second;
  }
  /// LinesConfigError that says what to write if the role has no line.
  const LineSettings& required(LineRole role) const;
};

/// `name` appears in messages.
LinesConfig parse_lines_config(std::string_view text, const std::string& name);
LinesConfig load_lines_config(const std::filesystem::path& file);

/// `given` (--lines), else KMAX_LINES, else kmax/lines.toml below XDG_CONFIG_HOME or ~/.config. Only the last
/// of them may be missing: then the configuration is empty.
LinesConfig find_lines_config(const std::string& given);

/// The last of those places, as messages name it.
std::filesystem::path default_lines_file();

}  // namespace kmax::lines
