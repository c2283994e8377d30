#include "host_tools/device/device_address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <vector>

namespace kmax::device {

namespace {
using firmware::Entry;
using firmware::entry_at;
using firmware::entry_of;

constexpr std::string_view forms =
    "allowed are sim, usb[:SERIAL], serial:PATH[?unit=1&baud=115200] and can:IFACE[?node=1]";

struct Option {
  std::string_view key;
  std::size_t entry;  ///< whose range or choices it must keep
};
constexpr Option serial_options[] = {{"unit", entry_of<"modbus.unit">()},
                                     {"baud", entry_of<"modbus.baud_rate">()}};
constexpr Option usb_options[] = {{"unit", entry_of<"modbus.unit">()}};
constexpr Option can_options[] = {{"node", entry_of<"node.id">()}};

[[noreturn]] void fail(std::string_view address, const std::string& what) {
  throw AddressError(fmt::format("device address '{}': {}", address, what));
}

std::string allowed_by(const Entry& entry) {
  if (entry.values.empty()) return fmt::format("{} .. {}", entry.minimum, entry.maximum);
  std::vector<std::string_view> names;
  for (const auto& value : entry.values) names.push_back(value.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

bool allows(const Entry& entry, std::uint32_t number) {
  if (entry.values.empty()) return entry.minimum <= number && number <= entry.maximum;
  return std::any_of(entry.values.begin(), entry.values.end(), [number](const auto& value) {
    return static_cast<std::uint32_t>(value.value) == number;
  });
}

std::uint32_t parse_option(std::string_view address, const Option& option, std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const Entry& entry = entry_at(option.entry);
  if (error != std::errc{} || end != text.data() + text.size() || !allows(entry, number))
    fail(address,
         fmt::format("{}={} is not allowed; {} must be {}", option.key, text, option.key, allowed_by(entry)));
  return number;
}

/// Calls set(entry, number) for each option of "a=1&b=2".
template <typename Set>
void parse_options(std::string_view address, std::string_view query, std::span<const Option> options,
                   Set set) {
  std::vector<std::string_view> seen;
  std::vector<std::string_view> keys;
  for (const Option& option : options) keys.push_back(option.key);
  for (;;) {
    const auto end = std::min(query.find('&'), query.size());
    const std::string_view item = query.substr(0, end);
    const auto equals = item.find('=');
    const std::string_view key = item.substr(0, equals);
    const auto known =
        std::find_if(options.begin(), options.end(), [key](const Option& o) { return o.key == key; });
    if (known == options.end())
      fail(address, fmt::format("there is no option '{}'; options are {}", key, fmt::join(keys, ", ")));
    if (equals == std::string_view::npos)
      fail(address, fmt::format("{} needs a value, as in {}=1", key, key));
    if (std::find(seen.begin(), seen.end(), key) != seen.end())
      fail(address, fmt::format("{} is given twice", key));
    seen.push_back(key);
    set(known->entry, parse_option(address, *known, item.substr(equals + 1)));
    if (end == query.size()) return;
    query.remove_prefix(end + 1);
  }
}

struct Scheme {
  std::string_view name;
  DeviceAddress::Kind kind;
  std::span<const Option> options;
  std::string_view missing;  ///< what is said where nothing stands behind the colon
};
constexpr Scheme schemes[] = {
    {"serial", DeviceAddress::Kind::serial, serial_options, "the port is missing, as in serial:/dev/ttyUSB0"},
    {"can", DeviceAddress::Kind::can, can_options, "the interface is missing, as in can:can0"},
    {"usb", DeviceAddress::Kind::usb, usb_options,
     "the serial number is missing, as in usb:1F2E3D4C; write usb for the only device"},
};

const Scheme* scheme_of(DeviceAddress::Kind kind) {
  const auto* const found = std::ranges::find(schemes, kind, &Scheme::kind);
  return found == std::end(schemes) ? nullptr : found;
}
}  // namespace

DeviceAddress parse_device_address(std::string_view text) {
  DeviceAddress address;
  if (text == "sim") return address;

  const auto question = text.find('?');
  const auto colon = std::min(text.find(':'), question);
  const std::string_view name = text.substr(0, colon);
  const bool colon_there = colon < text.size() && text[colon] == ':';
  const auto* const scheme = std::ranges::find(schemes, name, &Scheme::name);
  // Only a device on USB can be the only one.
  if (scheme == std::end(schemes) || (!colon_there && scheme->kind != DeviceAddress::Kind::usb)) {
    if (text.starts_with("/dev/")) fail(text, fmt::format("write serial:{}", text));
    if (text.empty()) fail(text, fmt::format("it is empty; {}", forms));
    if (name == "sim") fail(text, "the simulated device takes no options; write sim");
    fail(text, fmt::format("{}", forms));
  }
  address.kind = scheme->kind;
  if (colon_there) {
    address.path =
        text.substr(colon + 1, question == std::string_view::npos ? question : question - colon - 1);
    if (address.path.empty()) fail(text, std::string(scheme->missing));
  }
  if (question == std::string_view::npos) return address;

  parse_options(text, text.substr(question + 1), scheme->options,
                [&address](std::size_t entry, std::uint32_t number) {
                  if (entry == entry_of<"modbus.unit">()) address.unit = static_cast<std::uint8_t>(number);
                  if (entry == entry_of<"modbus.baud_rate">()) address.baud_rate = number;
                  if (entry == entry_of<"node.id">()) address.node = static_cast<std::uint8_t>(number);
                });
  return address;
}

std::string text_of(const DeviceAddress& address) {
  const DeviceAddress defaults;
  const Scheme* const scheme = scheme_of(address.kind);
  if (scheme == nullptr) return "sim";
  std::vector<std::string> options;
  // Of a kind that has no such option it is the default.
  if (address.unit != defaults.unit) options.push_back(fmt::format("unit={}", address.unit));
  if (address.baud_rate != defaults.baud_rate) options.push_back(fmt::format("baud={}", address.baud_rate));
  if (address.node != defaults.node) options.push_back(fmt::format("node={}", address.node));
  return fmt::format("{}{}{}{}{}", scheme->name, address.path.empty() ? "" : ":", address.path,
                     options.empty() ? "" : "?", fmt::join(options, "&"));
}

std::optional<std::string> device_address_of_environment() {
  const char* text = std::getenv("KMAX_DEVICE");
  if (text == nullptr || *text == '\0') return std::nullopt;
  return text;
}

}  // namespace kmax::device
