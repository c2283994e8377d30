#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace kmax::firmware {

/// Two sectors of flash memory that belong to the parameter store, equal in size.
///
/// Words of 32 bits; an erased word reads 0xFFFFFFFF; programming clears bits and never sets one; only
/// erasing a whole sector sets them again. erase() and program() return whether the memory says it worked;
/// the store reads back what it needs to be sure of. Main loop only; erase() may stall the processor (a
/// 16 KiB sector of an STM32F405: 250 ms typically, 500 ms at most; DS8626, flash memory programming).
template <typename Candidate>
concept FlashSectors = requires(Candidate& flash, const Candidate& constant, std::size_t sector,
                                std::size_t word, std::uint32_t value) {
  requires Candidate::sector_count == 2;
  { constant.words_per_sector } -> std::convertible_to<std::size_t>;
  { constant.read(sector, word) } -> std::same_as<std::uint32_t>;
  { flash.erase(sector) } -> std::same_as<bool>;
  { flash.program(sector, word, value) } -> std::same_as<bool>;
};

/// Any of them behind three plain function pointers, so that the application needs no template argument. It
/// refers to the memory, which must outlive it; an empty one has no memory: nothing is stored, every change
/// fails.
class AnyFlashSectors {
 public:
  static constexpr std::size_t sector_count = 2;
  std::size_t words_per_sector = 0;  ///< of the memory that it refers to

  AnyFlashSectors() = default;

  template <FlashSectors Flash>
  static AnyFlashSectors of(Flash& flash) {
    AnyFlashSectors any;
    any.flash_ = &flash;
    any.words_per_sector = Flash::words_per_sector;
    any.read_ = [](const void* self, std::size_t sector, std::size_t word) {
      return static_cast<const Flash*>(self)->read(sector, word);
    };
    any.erase_ = [](void* self, std::size_t sector) { return static_cast<Flash*>(self)->erase(sector); };
    any.program_ = [](void* self, std::size_t sector, std::size_t word, std::uint32_t value) {
      return static_cast<Flash*>(self)->program(sector, word, value);
    };
    return any;
  }

  bool present() const { return flash_ != nullptr; }

  std::uint32_t read(std::size_t sector, std::size_t word) const {
    return present() ? read_(flash_, sector, word) : 0xFFFF'FFFFU;
  }
  bool erase(std::size_t sector) { return present() && erase_(flash_, sector); }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    return present() && program_(flash_, sector, word, value);
  }

 private:
  void* flash_ = nullptr;
  std::uint32_t (*read_)(const void*, std::size_t, std::size_t) = nullptr;
  bool (*erase_)(void*, std::size_t) = nullptr;
  bool (*program_)(void*, std::size_t, std::size_t, std::uint32_t) = nullptr;
};

static_assert(FlashSectors<AnyFlashSectors>);

}  // namespace kmax::firmware
