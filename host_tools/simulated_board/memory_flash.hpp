#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kmax::simulated_board {

/// Two flash sectors in memory (firmware::FlashSectors): programming clears bits, erasing sets a sector's
/// bits. Both always work.
class MemoryFlash {
 public:
  static constexpr std::size_t sector_count = 2;
  static constexpr std::size_t words_per_sector = 4096;

  MemoryFlash() {
    for (auto& sector : words_) sector.fill(0xFFFF'FFFFU);
  }

  std::uint32_t read(std::size_t sector, std::size_t word) const { return words_.at(sector).at(word); }
  bool erase(std::size_t sector) {
    words_.at(sector).fill(0xFFFF'FFFFU);
    return true;
  }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    words_.at(sector).at(word) &= value;
    return true;
  }

 private:
  std::array<std::array<std::uint32_t, words_per_sector>, sector_count> words_;
};

}  // namespace kmax::simulated_board
