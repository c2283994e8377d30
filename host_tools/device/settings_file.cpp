#include "host_tools/device/settings_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>

#include "host_tools/base/files.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/base/toml_text.hpp"
#include "host_tools/device/device_address.hpp"

namespace kmax::device {

namespace {
/// The specification ignores a path that is not absolute.
std::filesystem::path folder_of(const char* variable) {
  const char* text = std::getenv(variable);
  const std::filesystem::path path = text == nullptr ? "" : text;
  return path.is_absolute() ? path : std::filesystem::path();
}
}  // namespace

std::filesystem::path settings_file() {
  if (const auto folder = folder_of("XDG_CONFIG_HOME"); !folder.empty())
    return folder / "kmax" / "config.toml";
  if (const auto home = folder_of("HOME"); !home.empty()) return home / ".config" / "kmax" / "config.toml";
  return {};
}

std::optional<std::string> default_device_address() {
  if (const auto address = device_address_of_environment()) return address;
  const std::filesystem::path file = settings_file();
  std::error_code unreadable;
  if (file.empty() || !std::filesystem::exists(file, unreadable)) return std::nullopt;
  const std::string text =
      base::text_of<AddressError>(file, "it holds your defaults for kmax; correct it or remove it");
  const toml::table table = base::parsed_toml<AddressError>(text, file.string());
  static const std::array<std::string, 1> keys = {"device"};
  for (const auto& [key, value] : table) {
    if (key.str() != keys[0])
      throw AddressError(
          fmt::format("{}: there is no setting '{}'{}; what may stand here is device = \"usb\", "
                      "\"serial:PATH\" or \"can:IFACE\"",
                      file.string(), key.str(), base::did_you_mean(key.str(), keys)));
  }
  if (!table.contains(keys[0])) return std::nullopt;
  const auto address = table[keys[0]].value<std::string>();
  if (!address || address->empty())
    throw AddressError(fmt::format(
        "{}: device is not an address; write it as in device = \"serial:/dev/ttyUSB0\"", file.string()));
  return address;
}

}  // namespace kmax::device
