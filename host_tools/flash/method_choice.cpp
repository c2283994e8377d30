#include "host_tools/flash/method_choice.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/flash/program.hpp"

namespace kmax::flash {

namespace {

using lines::LineRole;
using usb::UsbDevice;

struct Need {
  bool met;
  std::string text;
};

Need needs_of(Method method, const BoardProfile& board, const lines::LinesConfig& config,
              std::span<const UsbDevice> devices) {
  const auto has = [&config](LineRole role) { return config.find(role) != nullptr; };
  switch (method) {
    case Method::openocd_gpio:
      if (has(LineRole::swdio) && has(LineRole::swclk))
        return {true, "[lines.swdio] and [lines.swclk] are set"};
      return {false, fmt::format("[lines.swdio] and [lines.swclk] are not both in {}",
                                 config.file.empty() ? lines::default_lines_file().string() : config.file)};
    case Method::openocd_stlink:
      if (std::ranges::any_of(devices, &UsbDevice::is_st_link)) return {true, "an ST-Link is on USB"};
      return {false, "no ST-Link is on USB"};
    case Method::dfu:
      if (std::ranges::any_of(devices, &UsbDevice::is_dfu)) return {true, "a board in DFU mode is on USB"};
      if (!board.boot0_is_switch && has(LineRole::boot0) && has(LineRole::reset))
        return {true, "[lines.boot0] and [lines.reset] start the ROM bootloader; connect USB"};
      if (std::ranges::any_of(devices, &UsbDevice::is_kmax))
        return {true, "the firmware on USB can restart into its ROM bootloader"};
      return {false, fmt::format("neither Kmax nor a board in DFU mode (0483:df11) is on USB: {}",
                                 board.to_bootloader)};
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
                                         std::span<const usb::UsbDevice> devices) {
  std::vector<MethodVerdict> verdicts;
  for (const MethodFacts& facts : all_methods) {
    const MethodOnBoard& on_board = board.on(facts.method);
    if (!on_board.applies) {
      verdicts.push_back({facts.method, false, false, std::string(on_board.why)});
      continue;
    }
    const Need need = needs_of(facts.method, board, config, devices);
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

}  // namespace kmax::flash
