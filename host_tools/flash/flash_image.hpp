#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/base/elf_image.hpp"
#include "host_tools/flash/chip_memory.hpp"

// What has to be written of a firmware image: its load segments, joined where they lie in the same or in
// neighbouring sectors, padded with erased bytes to whole words.

namespace kmax::flash {

/// The image must not or cannot be flashed.
class ImageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Bytes that lie together, in sectors that no other piece touches.
struct FlashPiece {
  std::uint32_t address = 0;
  std::vector<std::uint8_t> bytes;

  std::uint32_t end() const { return address + static_cast<std::uint32_t>(bytes.size()); }
  std::string file_name() const;       ///< "image_08000000.bin"
  std::string read_file_name() const;  ///< "read_08000000.bin"
};

/// CRC-32 (firmware/parameters/crc32.hpp; the one of zip and Ethernet) of whole words.
std::uint32_t crc_of(const std::vector<std::uint8_t>& bytes);

class FlashImage {
 public:
  /// Throws ImageError: not an ELF image for ARM, touches the parameter sectors, lies outside flash, two
  /// segments overlap, does not open flash with a plausible vector table, or was linked for other parameter
  /// sectors.
  static FlashImage load(const std::filesystem::path& elf, const ChipMemory& memory);
  static FlashImage from(const base::ElfImage& elf, const std::string& name, const ChipMemory& memory);

  /// By address; the first holds the vector table.
  const std::vector<FlashPiece>& pieces() const { return pieces_; }
  std::size_t size() const;
  /// Of all pieces, one after the other.
  std::uint32_t crc() const;

 private:
  std::vector<FlashPiece> pieces_;
};

}  // namespace kmax::flash
