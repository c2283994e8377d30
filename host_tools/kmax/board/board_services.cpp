#include "host_tools/kmax/board/board_services.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace kmax::cli {

const BoardServices& board_services(const Context& context) {
  static const BoardServices of_this_computer;
  return context.board_services ? *context.board_services : of_this_computer;
}

void add_lines_option(CLI::App& command, std::string& file) {
  command
      .add_option("--lines", file,
                  "TOML file that says which GPIO line is wired to what; also from KMAX_LINES (default: "
                  "~/.config/kmax/lines.toml)")
      ->type_name("FILE");
}

lines::LinesConfig read_lines_config(const std::string& file) {
  try {
    return lines::find_lines_config(file);
  } catch (const lines::LinesConfigError& error) {
    throw UsageError(error.what());
  }
}

const flash::BoardProfile& chosen_board(const std::string& option, const lines::LinesConfig& config) {
  const std::string kind = !option.empty()              ? option
                           : !config.board_kind.empty() ? config.board_kind
                                                        : std::string("odrive_v3");
  if (const flash::BoardProfile* board = flash::board_of_kind(kind)) return *board;
  throw UsageError(fmt::format("{}there is no board '{}'; boards are {}",
                               option.empty() ? config.file + ": [board] kind: " : "--board: ", kind,
                               flash::board_kinds()));
}

}  // namespace kmax::cli
