#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace kmax::flash {

struct Sector {
  std::uint32_t begin, size;
  constexpr std::uint32_t end() const { return begin + size; }
};

/// A chip's memory as a flashing tool sees it, and what of its flash belongs to the parameter store.
struct ChipMemory {
  std::span<const Sector> sectors;     ///< of the flash, without gaps
  std::size_t first_parameter_sector;  ///< of the two of the store (firmware::FlashSectors)
  std::span<const Sector> ram;         ///< where a stack may be

  constexpr std::uint32_t flash_begin() const { return sectors.front().begin; }
  constexpr std::uint32_t flash_end() const { return sectors.back().end(); }
  constexpr std::span<const Sector> parameter_sectors() const {
    return sectors.subspan(first_parameter_sector, 2);
  }
  constexpr std::uint32_t parameters_begin() const { return parameter_sectors().front().begin; }
  constexpr std::uint32_t parameters_end() const { return parameter_sectors().back().end(); }
  constexpr std::uint32_t parameters_size() const { return parameters_end() - parameters_begin(); }

  /// Number of the sector that holds the address.
  constexpr std::optional<std::size_t> sector_of(std::uint32_t address) const {
    for (std::size_t i = 0; i < sectors.size(); ++i) {
      if (address >= sectors[i].begin && address < sectors[i].end()) return i;
    }
    return std::nullopt;
  }
};

/// STM32F405RG (RM0090: embedded flash memory interface, flash module organization; memory map), with the
/// parameters where board/stm32f405/linker.ld has them.
inline constexpr std::array<Sector, 12> stm32f405_sectors = [] {
  std::array<Sector, 12> made{};
  std::uint32_t at = 0x0800'0000;
  for (std::size_t i = 0; i < made.size(); ++i) {
    const std::uint32_t size = i < 4 ? 0x4000 : i == 4 ? 0x1'0000 : 0x2'0000;
    made[i] = {at, size};
    at += size;
  }
  return made;
}();
inline constexpr std::array<Sector, 2> stm32f405_ram = {{{0x2000'0000, 0x2'0000}, {0x1000'0000, 0x1'0000}}};
inline constexpr ChipMemory stm32f405_memory{stm32f405_sectors, 1, stm32f405_ram};
static_assert(stm32f405_memory.flash_end() == 0x0810'0000);
static_assert(stm32f405_memory.parameters_begin() == 0x0800'4000);
static_assert(stm32f405_memory.parameters_end() == 0x0800'C000);

}  // namespace kmax::flash
