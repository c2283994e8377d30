#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kmax::cli {

/// Where a user's own defaults are: $XDG_CONFIG_HOME/kmax/config.toml, or ~/.config/kmax/config.toml (XDG
/// Base Directory Specification 0.8). Empty where neither variable is set.
std::filesystem::path settings_file();

/// Its `device`, an address as --device takes it; nothing if there is no such file or it names none. A file
/// that cannot be read, or that has another key, throws a UsageError that says which and what is allowed.
std::optional<std::string> device_of_settings_file();

}  // namespace kmax::cli
