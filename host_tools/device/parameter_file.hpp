#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/device/value_text.hpp"

namespace kmax::device {

// A set of parameters as a TOML file, to be read and edited by people:
//
//   # firmware 0.1.0
//   [wall]
//   law = "magnetic"  # none, plain, magnetic, adaptive
//   stiffness = 3580  # N/m
//
//   [axis1.wall]
//   side = -1  # -1, +1
//
// Names are the dictionary's; axis 0 needs no prefix. A number is in the parameter's own unit (SI); a text
// may have a unit that converts to it ("3.58 N/mm"), as parse_value() reads it. Choices go by name or number.

/// What a file can hold: all that 'kmax save' keeps and that can be written through every link. CANopen's own
/// settings are not among them.
std::vector<Parameter> file_parameters();

/// Where a file's values come from, for the comment at its top.
struct FileOrigin {
  std::string device;    ///< vendor, board, serial number; one line
  std::string firmware;  ///< version
};

/// The file's text, grouped; the same values always give the same text, since there is no date in it.
std::string parameter_file_text(const FileOrigin& origin, std::span<const Assignment> assignments);

struct FileSetting {
  Assignment assignment;
  std::size_t line;
};

/// The settings of a file in the order of its lines; `source` stands for its name in messages.
///
/// Refused: what is not TOML; names that do not exist, can only be read, are commands or are not kept by
/// 'kmax save'; values of the wrong type or out of range; a parameter that is given twice under two
/// spellings; a file without parameters. Nothing is skipped: one bad line refuses the file. The message has
/// up to ten bad lines, "SOURCE:LINE:COLUMN: what is wrong, what is allowed" each. Errors: ValueError.
std::vector<FileSetting> parse_parameter_file(std::string_view text, const std::string& source);

/// The same of a file. Errors: ValueError, also if it cannot be read.
std::vector<FileSetting> read_parameter_file(const std::string& path);

}  // namespace kmax::device
