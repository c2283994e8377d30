#include "host_tools/usb/usb_devices.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>
#include <utility>

#include "firmware/usb/descriptors.hpp"

namespace kmax::usb {

namespace fs = std::filesystem;

namespace {
std::string first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

/// A device says of itself what it likes, and this is printed, and part of addresses and of other programs'
/// arguments.
std::string letters_and_digits(std::string text) {
  std::erase_if(text, [](unsigned char c) {
    return !((c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'));
  });
  return text;
}
std::string printable(std::string text) {
  std::erase_if(text, [](unsigned char c) { return c < 0x20 || c == 0x7F; });
  return text;
}

template <typename Number>
std::optional<Number> number_in(const std::string& text, int base) {
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// dev_id, which gs_usb sets to the channel: "0x1".
unsigned channel_of(const fs::path& interface) {
  const std::string text = first_line(interface / "dev_id");
  return text.starts_with("0x") ? number_in<unsigned>(text.substr(2), 16).value_or(0) : 0;
}

void add_what_drivers_made(UsbDevice& device, const fs::path& folder) {
  std::vector<std::pair<unsigned, std::string>> channels;
  std::error_code gone;
  for (const auto& interface : fs::directory_iterator(folder, gone)) {
    if (!interface.path().filename().string().starts_with(device.port + ":")) continue;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(interface.path() / "tty", none))
      device.terminals.push_back(entry.path().filename().string());
    for (const auto& entry : fs::directory_iterator(interface.path() / "net", none))
      channels.emplace_back(channel_of(entry.path()), entry.path().filename().string());
  }
  std::ranges::sort(device.terminals);
  std::ranges::sort(channels);
  for (auto& [channel, name] : channels) device.can.push_back(std::move(name));
}
}  // namespace

bool UsbDevice::is_st_link() const {
  // Those that OpenOCD 0.12 looks for, interface/stlink.cfg.
  static constexpr std::array<std::uint16_t, 9> products = {0x3744, 0x3748, 0x374B, 0x374D, 0x374E,
                                                            0x374F, 0x3752, 0x3753, 0x3754};
  return vendor == 0x0483 && std::ranges::find(products, product) != products.end();
}

bool UsbDevice::is_kmax() const {
  using firmware::usb::identity;
  return vendor == identity.vendor && product == identity.product &&
         maker == firmware::usb::text_of(firmware::usb::Text::maker);
}

std::string UsbDevice::node() const {
  return fmt::format("{:03}/{:03}", bus, number);
}

std::vector<UsbDevice> list_usb_devices(const fs::path& folder) {
  std::vector<UsbDevice> found;
  std::error_code no_folder;
  for (const auto& entry : fs::directory_iterator(folder, no_folder)) {
    const fs::path& path = entry.path();
    const auto vendor = number_in<std::uint16_t>(first_line(path / "idVendor"), 16);
    const auto product = number_in<std::uint16_t>(first_line(path / "idProduct"), 16);
    if (!vendor || !product) continue;
    UsbDevice device{*vendor, *product, letters_and_digits(first_line(path / "serial"))};
    device.maker = printable(first_line(path / "manufacturer"));
    device.port = path.filename().string();
    device.bus = number_in<unsigned>(first_line(path / "busnum"), 10).value_or(0);
    device.number = number_in<unsigned>(first_line(path / "devnum"), 10).value_or(0);
    add_what_drivers_made(device, path);
    found.push_back(std::move(device));
  }
  std::ranges::sort(found, {}, &UsbDevice::port);
  return found;
}

bool may_open(const fs::path& file) {
  return faccessat(AT_FDCWD, file.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
}

}  // namespace kmax::usb
