#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/stm32f4/flash_sectors.hpp"
#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// The parameter sectors of a board's flash, seen from outside while its power is off:
/// firmware::FlashSectors.
class ParameterSectors {
 public:
  static constexpr std::size_t sector_count = 2;
  static constexpr std::size_t words_per_sector = drivers::stm32f4::FlashSectors<>::words_per_sector;

  explicit ParameterSectors(Bus& bus);

  std::uint32_t read(std::size_t sector, std::size_t word) const;
  bool erase(std::size_t sector);
  bool program(std::size_t sector, std::size_t word, std::uint32_t value);

 private:
  std::span<std::uint8_t> bytes_;
};

/// Puts these parameters into the flash as a save of the firmware would, so that the board starts with them.
/// Call it before the first run. Throws std::runtime_error when the set is refused or does not fit.
void store_parameters(VirtualBoard& board, const std::vector<device::Assignment>& assignments);

}  // namespace kmax::virtual_board
