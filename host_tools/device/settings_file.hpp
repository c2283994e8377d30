#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kmax::device {

/// Where a user's own defaults are: $XDG_CONFIG_HOME/kmax/config.toml, or ~/.config/kmax/config.toml (XDG
/// Base Directory Specification 0.8). Empty where neither variable is set.
std::filesystem::path settings_file();

/// The device for whoever names none: KMAX_DEVICE, else the settings file's `device`, an address as
/// parse_device_address() takes it; nothing if neither is there. A file that cannot be read, or that has
/// another key, throws an AddressError that says which and what is allowed.
std::optional<std::string> default_device_address();

}  // namespace kmax::device
