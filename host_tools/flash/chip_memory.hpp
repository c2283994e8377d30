#pragma once

#include <array>
#include <cstdint>
#include <optional>

// Flash of the STM32F405RG as a flashing tool sees it (RM0090, embedded flash memory interface, flash module
// organization), and what of it belongs to the parameter store (board/stm32f405/linker.ld).

namespace kmax::flash {

struct Sector {
  std::uint32_t begin, size;
  constexpr std::uint32_t end() const { return begin + size; }
};

inline constexpr std::uint32_t flash_begin = 0x0800'0000, flash_end = 0x0810'0000;
inline constexpr std::uint32_t parameters_begin = 0x0800'4000, parameters_end = 0x0800'C000;
inline constexpr std::uint32_t parameters_size = parameters_end - parameters_begin;

inline constexpr std::array<Sector, 12> sectors = [] {
  std::array<Sector, 12> made{};
  std::uint32_t at = flash_begin;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const std::uint32_t size = i < 4 ? 0x4000 : i == 4 ? 0x1'0000 : 0x2'0000;
    made[i] = {at, size};
    at += size;
  }
  return made;
}();
static_assert(sectors.back().end() == flash_end);
static_assert(sectors[1].begin == parameters_begin && sectors[2].end() == parameters_end);

/// Number of the sector that holds the address.
constexpr std::optional<std::size_t> sector_of(std::uint32_t address) {
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    if (address >= sectors[i].begin && address < sectors[i].end()) return i;
  }
  return std::nullopt;
}

}  // namespace kmax::flash
