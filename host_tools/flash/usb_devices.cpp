#include "host_tools/flash/usb_devices.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>

namespace kmax::flash {

namespace {
std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

std::optional<std::uint16_t> hexadecimal(const std::string& text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}
}  // namespace

bool UsbDevice::is_st_link() const {
  // Those that OpenOCD 0.12 looks for, interface/stlink.cfg.
  static constexpr std::array<std::uint16_t, 9> products = {0x3744, 0x3748, 0x374B, 0x374D, 0x374E,
                                                            0x374F, 0x3752, 0x3753, 0x3754};
  return vendor == 0x0483 && std::find(products.begin(), products.end(), product) != products.end();
}

std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& folder) {
  std::vector<UsbDevice> found;
  std::error_code no_folder;
  for (const auto& entry : std::filesystem::directory_iterator(folder, no_folder)) {
    const auto vendor = hexadecimal(first_line(entry.path() / "idVendor"));
    const auto product = hexadecimal(first_line(entry.path() / "idProduct"));
    if (vendor && product) found.push_back({*vendor, *product, first_line(entry.path() / "serial")});
  }
  return found;
}

}  // namespace kmax::flash
