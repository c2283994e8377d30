#include "host_tools/flash/method_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>

#include "host_tools/flash/program.hpp"

namespace kmax::flash {

namespace {

using lines::LineRole;

struct Need {
  bool met;
  std::string text;
};

Need needs_of(Method method, const BoardProfile& board, const lines::LinesConfig& config,
              std::span<const UsbDevice> usb) {
  const auto has = [&config](LineRole role) { return config.find(role) != nullptr; };
  switch (method) {
    case Method::openocd_gpio:
      if (has(LineRole::swdio) && has(LineRole::swclk))
        return {true, "[lines.swdio] and [lines.swclk] are set"};
      return {false, fmt::format("[lines.swdio] and [lines.swclk] are not both in {}",
                                 config.file.empty() ? lines::default_lines_file().string() : config.file)};
    case Method::openocd_stlink:
      if (std::ranges::any_of(usb, &UsbDevice::is_st_link)) return {true, "an ST-Link is on USB"};
      return {false, "no ST-Link is on USB"};
    case Method::dfu:
      if (std::ranges::any_of(usb, &UsbDevice::is_dfu)) return {true, "a board in DFU mode is on USB"};
      if (!board.boot0_is_switch && has(LineRole::boot0) && has(LineRole::reset))
        return {true, "[lines.boot0] and [lines.reset] start the ROM bootloader; connect USB"};
      return {false, fmt::format("no board in DFU mode (0483:df11) is on USB: {}", board.to_bootloader)};
    case Method::serial:
      break;
  }
  if (config.serial_port.empty()) return {false, "[board] serial_port is not set"};
  if (!has(LineRole::boot0) || !has(LineRole::reset))
    return {false, "[lines.boot0] and [lines.reset] are not both set"};
  return {true, fmt::format("{}, [lines.boot0] and [lines.reset] are set", config.serial_port)};
}

std::string listed(const BoardProfile& board, std::span<const MethodVerdict> verdicts) {
  std::string text;
  for (const MethodVerdict& verdict : verdicts)
    text += fmt::format("\n  {:15} {}: {}", facts_of(verdict.method).name,
                        verdict.ready     ? "ready"
                        : verdict.applies ? "possible"
                                          : "not on this board",
                        verdict.applies && !verdict.ready
                            ? fmt::format("{}, but {}", board.on(verdict.method).why, verdict.text)
                            : verdict.text);
  return text;
}

}  // namespace

std::vector<MethodVerdict> judge_methods(const BoardProfile& board, const lines::LinesConfig& config,
                                         std::span<const UsbDevice> usb) {
  std::vector<MethodVerdict> verdicts;
  for (const MethodFacts& facts : all_methods) {
    const MethodOnBoard& on_board = board.on(facts.method);
    if (!on_board.applies) {
      verdicts.push_back({facts.method, false, false, std::string(on_board.why)});
      continue;
    }
    const Need need = needs_of(facts.method, board, config, usb);
    if (need.met && !find_program(std::string(facts.program))) {
      verdicts.push_back(
          {facts.method, true, false,
           fmt::format("the program {} is not installed: apt-get install {}", facts.program, facts.package)});
    } else {
      verdicts.push_back({facts.method, true, need.met, need.text});
    }
  }
  return verdicts;
}

Method choose_method(const std::string& wanted, const BoardProfile& board,
                     std::span<const MethodVerdict> verdicts, bool dry) {
  for (const MethodVerdict& verdict : verdicts) {
    const std::string_view name = facts_of(verdict.method).name;
    if (wanted == "auto" ? verdict.ready : wanted == name && (verdict.ready || (dry && verdict.applies)))
      return verdict.method;
    if (wanted != name) continue;
    if (!verdict.applies)
      throw MethodNotOnBoardError(fmt::format("--method {}: not on {}: {}", name, board.title, verdict.text));
    throw MethodError(fmt::format("--method {}: {}", name, verdict.text));
  }
  throw MethodError(fmt::format("{} cannot be flashed right now{}", board.title, listed(board, verdicts)));
}

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
