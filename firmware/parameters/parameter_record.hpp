#pragma once

#include <cstddef>
#include <cstdint>

#include "firmware/board_interface/flash_sectors.hpp"
#include "firmware/parameters/crc32.hpp"

/// The parameter store's format in flash, in words of 32 bits:
///
///     0      magic, which is also the format's version
///     1      sequence: one more than the record before, modulo 2^32
///     2      checksum of the object dictionary that wrote it
///     3      erases of both sectors so far, as far as known
///     4      count of parameters
///     5..    count times: identity, value
///     then   CRC-32 of all words before it
///     last   commit word, written when every word before it has been written and read back
///
/// A record begins at a multiple of `alignment` words, so that a place spoilt by a cut write is stepped over
/// without believing its length. Space begins after the last word of a sector that is not erased.
namespace kmax::firmware::record {

/// "KMP2". Records of "KMP1" name the device's parameters by indices that are a third axis' now; they are not
/// read.
inline constexpr std::uint32_t magic = 0x4B4D'5032;
/// All bits cleared: programming cannot change it any more, and any bit that rises makes it invalid.
inline constexpr std::uint32_t commit = 0;
inline constexpr std::uint32_t erased = 0xFFFF'FFFF;
inline constexpr std::size_t alignment = 16;

inline constexpr std::size_t header_words = 5;

constexpr std::size_t length_of(std::size_t count) {
  return header_words + 2 * count + 2;
}
constexpr std::size_t aligned_up(std::size_t word) {
  return (word + alignment - 1) / alignment * alignment;
}

struct Header {
  std::uint32_t sequence = 0;
  std::uint32_t schema = 0;
  std::uint32_t erases = 0;
  std::uint32_t count = 0;

  constexpr std::uint32_t word(std::size_t i) const {
    const std::uint32_t words[header_words] = {magic, sequence, schema, erases, count};
    return words[i];
  }
};

enum class Condition : std::uint8_t {
  none,         ///< no record begins here
  damaged,      ///< one began, and is cut short or changed
  uncommitted,  ///< whole, but the last step is missing: not valid
  valid,
};

struct Found {
  Condition condition = Condition::none;
  Header header{};
};

/// What stands at a word of a sector. Reads the record once, and never beyond the sector's end.
template <FlashSectors Flash>
Found examine(const Flash& flash, std::size_t sector, std::size_t word) {
  if (word + length_of(0) > flash.words_per_sector || flash.read(sector, word) != magic) return {};
  Found found{Condition::damaged, {}};
  found.header = {flash.read(sector, word + 1), flash.read(sector, word + 2), flash.read(sector, word + 3),
                  flash.read(sector, word + 4)};
  const std::uint32_t count = found.header.count;
  if (count > flash.words_per_sector || word + length_of(count) > flash.words_per_sector) return found;
  Crc32 crc;
  const std::size_t covered = length_of(count) - 2;
  for (std::size_t i = 0; i < covered; ++i) crc.add(flash.read(sector, word + i));
  if (flash.read(sector, word + covered) != crc.value()) return found;
  found.condition =
      flash.read(sector, word + covered + 1) == commit ? Condition::valid : Condition::uncommitted;
  return found;
}

/// Whether sequence a was written after b, across the wrap.
constexpr bool later(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) > 0;
}

}  // namespace kmax::firmware::record
