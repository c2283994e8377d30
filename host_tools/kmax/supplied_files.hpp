#pragma once

#include <filesystem>
#include <string>

namespace kmax::cli {

/// Where a file that comes with this program is: below the build tree, `built`, or installed in share/kmax
/// under its last name. Empty if it is in neither.
std::filesystem::path supplied_file(const std::filesystem::path& built);

/// "kmax 0.1.0, commit 1a2b3c4". A program from a work tree does not know its commit: `known_commit`, if it
/// is not empty, is named instead of it.
std::string program_text(const std::string& known_commit = {});

/// program_text(), and on a second line the image that is supplied, with its CRC-32.
std::string version_text();

}  // namespace kmax::cli
