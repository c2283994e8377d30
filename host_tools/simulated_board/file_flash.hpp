#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

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

/// Two flash sectors in a file of 32 KiB (firmware::FlashSectors): what a board's flash would hold, sector 0
/// first, words low byte first.
///
/// Every change is written through before the call returns, so the file is what it would be had the power
/// been cut when the process ends, however it ends; it does not wait for the disk, so it promises nothing
/// about the PC's own power. One process at a time: the file is locked while it is open.
class FileFlash {
 public:
  static constexpr std::size_t sector_count = MemoryFlash::sector_count;
  static constexpr std::size_t words_per_sector = MemoryFlash::words_per_sector;
  static constexpr std::size_t file_size = sector_count * words_per_sector * 4;

  /// A file that does not exist or is empty becomes an erased memory. Throws std::runtime_error for one that
  /// cannot be used, has another size, holds something else, or is in use; nothing is written then.
  explicit FileFlash(const std::string& path);
  ~FileFlash();
  FileFlash(const FileFlash&) = delete;
  FileFlash& operator=(const FileFlash&) = delete;

  std::uint32_t read(std::size_t sector, std::size_t word) const { return image_.read(sector, word); }
  /// False if the file could not be written.
  bool erase(std::size_t sector);
  bool program(std::size_t sector, std::size_t word, std::uint32_t value);

 private:
  void fill_or_read(const std::string& path);
  bool is_erased_or_ours() const;
  bool write_through(std::size_t sector, std::size_t first_word, std::size_t count);

  MemoryFlash image_;
  int file_ = -1;
};

}  // namespace kmax::simulated_board
