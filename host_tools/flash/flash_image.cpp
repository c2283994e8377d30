#include "host_tools/flash/flash_image.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "firmware/parameters/crc32.hpp"

namespace kmax::flash {
namespace {

constexpr std::uint8_t erased = 0xFF;

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw ImageError(fmt::format("{}: {}", name, why));
}

std::uint32_t word_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8U | std::uint32_t{bytes[at + 2]} << 16U |
         std::uint32_t{bytes[at + 3]} << 24U;
}

void check_place(const base::ElfSegment& segment, const std::string& name, const ChipMemory& memory) {
  const std::uint64_t end = std::uint64_t{segment.address} + segment.bytes.size();
  const std::string text =
      fmt::format("a segment at 0x{:08x}, {} bytes,", segment.address, segment.bytes.size());
  if (segment.address < memory.flash_begin() || end > memory.flash_end())
    refuse(name, fmt::format("{} lies outside the flash, 0x{:08x} to 0x{:08x}", text, memory.flash_begin(),
                             memory.flash_end() - 1));
  if (segment.address < memory.parameters_end() && end > memory.parameters_begin())
    refuse(name,
           fmt::format("{} covers the parameter sectors {} and {}, 0x{:08x} to 0x{:08x}; an image never "
                       "writes them, see board/stm32f405/linker.ld",
                       text, memory.first_parameter_sector, memory.first_parameter_sector + 1,
                       memory.parameters_begin(), memory.parameters_end() - 1));
  if (segment.address % 4 != 0) refuse(name, fmt::format("{} does not begin at a whole word", text));
}

/// An image may name the parameter sectors it was linked for.
void check_parameter_symbols(const base::ElfImage& elf, const std::string& name, const ChipMemory& memory) {
  const auto begin = elf.symbol("kmax_parameters_begin");
  const auto end = elf.symbol("kmax_parameters_end");
  if ((begin && begin->address != memory.parameters_begin()) ||
      (end && end->address != memory.parameters_end()))
    refuse(name, fmt::format("was linked for parameters at 0x{:08x} to 0x{:08x}; this program keeps 0x{:08x} "
                             "to 0x{:08x}. Use the kmax of the same release",
                             begin ? begin->address : 0, end ? end->address - 1 : 0,
                             memory.parameters_begin(), memory.parameters_end() - 1));
}

/// PM0214, exception model, vector table: the first word is the stack pointer, the second the start address
/// with the Thumb bit.
void check_vectors(const std::vector<FlashPiece>& pieces, const std::string& name, const ChipMemory& memory) {
  const FlashPiece& first = pieces.front();
  if (first.address != memory.flash_begin() || first.bytes.size() < 8)
    refuse(name, fmt::format("nothing is at 0x{:08x}, where the processor starts", memory.flash_begin()));
  const std::uint32_t stack = word_at(first.bytes, 0), start = word_at(first.bytes, 4);
  const bool in_memory = std::ranges::any_of(
      memory.ram, [stack](const Sector& ram) { return stack > ram.begin && stack <= ram.end(); });
  if (!in_memory || stack % 4 != 0)
    refuse(name, fmt::format("no vector table for the chip: its stack pointer is 0x{:08x}", stack));
  bool found = false;
  for (const FlashPiece& piece : pieces) found = found || (start >= piece.address && start < piece.end());
  if ((start & 1U) == 0 || !found)
    refuse(name, fmt::format("no vector table for the chip: its start address is 0x{:08x}", start));
}

}  // namespace

std::string FlashPiece::file_name() const {
  return fmt::format("image_{:08x}.bin", address);
}

std::string FlashPiece::read_file_name() const {
  return fmt::format("read_{:08x}.bin", address);
}

std::uint32_t crc_of(const std::vector<std::uint8_t>& bytes) {
  firmware::Crc32 crc;
  for (std::size_t at = 0; at + 4 <= bytes.size(); at += 4) crc.add(word_at(bytes, at));
  return crc.value();
}

FlashImage FlashImage::load(const std::filesystem::path& elf, const ChipMemory& memory) {
  try {
    return from(base::ElfImage::load(elf), elf.string(), memory);
  } catch (const base::ElfError& error) {
    throw ImageError(error.what());
  }
}

FlashImage FlashImage::from(const base::ElfImage& elf, const std::string& name, const ChipMemory& memory) {
  FlashImage image;
  for (const base::ElfSegment& segment : elf.segments()) {
    check_place(segment, name, memory);
    if (!image.pieces_.empty() && segment.address < image.pieces_.back().end())
      refuse(name, fmt::format("two segments overlap at 0x{:08x}", segment.address));
    // With check_place: never over the parameter sectors, which lie between others.
    const bool joins = !image.pieces_.empty() && *memory.sector_of(segment.address) <=
                                                     *memory.sector_of(image.pieces_.back().end() - 1) + 1;
    if (!joins) image.pieces_.push_back({segment.address, {}});
    auto& bytes = image.pieces_.back().bytes;
    bytes.resize(segment.address - image.pieces_.back().address, erased);
    bytes.insert(bytes.end(), segment.bytes.begin(), segment.bytes.end());
    bytes.resize((bytes.size() + 3) / 4 * 4, erased);
  }
  check_vectors(image.pieces_, name, memory);
  check_parameter_symbols(elf, name, memory);
  return image;
}

std::size_t FlashImage::size() const {
  std::size_t sum = 0;
  for (const FlashPiece& piece : pieces_) sum += piece.bytes.size();
  return sum;
}

std::uint32_t FlashImage::crc() const {
  std::vector<std::uint8_t> all;
  for (const FlashPiece& piece : pieces_) all.insert(all.end(), piece.bytes.begin(), piece.bytes.end());
  return crc_of(all);
}

}  // namespace kmax::flash
