#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "host_tools/flash/chip_memory.hpp"

// The ways to write a board's flash, and which of them a board has.

namespace kmax::flash {

enum class Method : std::uint8_t { openocd_gpio, openocd_stlink, dfu, serial };

struct MethodFacts {
  Method method;
  std::string_view name;     ///< as --method takes it
  std::string_view program;  ///< that does it
  std::string_view package;  ///< of Debian that has the program
};

inline constexpr std::array<MethodFacts, 4> all_methods = {{
    {Method::openocd_gpio, "openocd-gpio", "openocd", "openocd"},
    {Method::openocd_stlink, "openocd-stlink", "openocd", "openocd"},
    {Method::dfu, "dfu", "dfu-util", "dfu-util"},
    {Method::serial, "serial", "stm32flash", "stm32flash"},
}};
constexpr const MethodFacts& facts_of(Method method) {
  return all_methods[static_cast<std::size_t>(method)];
}

struct MethodOnBoard {
  bool applies;
  std::string_view why;
};

struct BoardProfile {
  std::string_view kind;  ///< as the configuration and --board call it
  std::string_view title;
  std::string_view openocd_target;  ///< the chip's configuration file of OpenOCD
  const ChipMemory* memory;         ///< the chip's
  std::string_view image;  ///< of its firmware, PRESET/FILE below the build folder; empty: none is supplied
  bool boot0_is_switch;    ///< no GPIO line can start the ROM bootloader
  std::string_view to_bootloader;  ///< what a person does to start the ROM bootloader
  std::string_view to_application;
  std::array<MethodOnBoard, 4> methods;  ///< in the order of all_methods

  constexpr const MethodOnBoard& on(Method method) const { return methods[static_cast<std::size_t>(method)]; }
};

std::span<const BoardProfile> all_boards();
/// nullptr if there is none.
const BoardProfile* board_of_kind(std::string_view kind);
/// "odrive_v3, generic_stm32f405"
std::string board_kinds();

}  // namespace kmax::flash
