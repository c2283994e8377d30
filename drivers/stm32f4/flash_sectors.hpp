#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/register_field.hpp"
#include "drivers/stm32f4/registers/flash.hpp"

// Erases and programs two sectors of 16 KiB of the on-chip flash, and no others: the parameter sectors.
// RM0090, chapter on the embedded flash memory interface: unlocking, sector erase, standard programming.
//
// THE CORE STANDS STILL. The part has one bank: while it erases or programs, every instruction fetch from
// flash waits, and with it every interrupt. Erasing takes 250 ms (500 ms at most), a word 16 us (100 us)
// at 2.7 to 3.6 V (STM32F405 data sheet, flash memory characteristics). So: only with the power stage off,
// and with a watchdog that is guaranteed to last longer than `longest_erase_ms` and is fed just before.
//
// Each operation unlocks the control register for itself and locks it again on every way out but one: if the
// flash is still busy when the wait ends, writing CR would stall the bus for as long as that lasts, so it is
// left alone; the next operation waits, and locks, first.
//
// The data cache is off during each operation and comes back empty: what is read back comes from the flash,
// and an erased sector is not seen through old lines. Endurance is 10,000 erases.
//
// Contexts: one at a time, not from interrupts.

namespace kmax::drivers::stm32f4 {

enum class FlashResult : std::uint8_t {
  done,
  out_of_range,       // no such sector or word; nothing was touched
  not_erased,         // the value has ones where the flash has zeros; nothing was touched
  busy,               // an earlier operation did not end in time; nothing was touched
  locked,             // the control register would not unlock (wrong key since reset); nothing was touched
  timed_out,          // started, but still busy at the end of the wait
  write_protected,    // option bytes protect the sector
  alignment_error,    // PGAERR
  parallelism_error,  // PGPERR
  sequence_error,     // PGSERR
  operation_error,    // OPERR
  wrong_content,      // no flag, but what was read back is not what should be there
};

/// Limits of the waits, in register reads of at least five core cycles. At 168 MHz: 0.9 s for an erase, 0.6
/// ms for a word. On silicon a read rarely happens before the end, since the loop itself is fetched from
/// flash.
struct FlashWaits {
  std::uint32_t erase = 30'000'000;
  std::uint32_t word = 20'000;
};

inline constexpr std::uint32_t longest_erase_ms = 500;

/// Satisfies the concept of the parameter store's medium. `Word` is what a word of flash memory looks like to
/// the program: a volatile word, or a test's stand-in for it.
template <typename Flash = FlashRegisters, typename Word = volatile std::uint32_t>
class FlashSectors {
 public:
  static constexpr std::size_t sector_count = 2;
  static constexpr std::size_t words_per_sector = 4096;
  static constexpr std::uint32_t erased = 0xFFFF'FFFF;

  /// `words` is the memory of a sector of 16 KiB, `number` its number for the controller: 0 to 3.
  struct Sector {
    std::uint32_t number;
    std::span<Word, words_per_sector> words;
  };

  FlashSectors(Flash& flash, const std::array<Sector, sector_count>& sectors, FlashWaits waits = {})
      : flash_(flash), sectors_(sectors), waits_(waits) {}

  /// The content of a sector, 0 or 1.
  std::span<const Word, words_per_sector> words(std::size_t sector) const { return sectors_[sector].words; }

  /// 0, which no erased word is, outside the two sectors.
  std::uint32_t read(std::size_t sector, std::size_t word) const {
    return inside(sector, word) ? content(sector, word) : 0;
  }

  /// All words of the sector become 0xFFFFFFFF; false unless they all read back so.
  [[nodiscard]] bool erase(std::size_t sector) {
    if (!inside(sector, 0)) return finish(FlashResult::out_of_range);
    return run(
        flash_cr::SectorErase::mask | flash_cr::Sector::bits(sectors_[sector].number), waits_.erase,
        [&] { flash_cr::Start::set(flash_.cr); }, [&] { return blank(sector); });
  }

  /// Programs a word that is erased, or of which bits are to be cleared; false unless it reads back as
  /// written.
  [[nodiscard]] bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    if (!inside(sector, word)) return finish(FlashResult::out_of_range);
    if ((content(sector, word) & value) != value) return finish(FlashResult::not_erased);
    return run(
        flash_cr::Program::mask, waits_.word, [&] { sectors_[sector].words[word] = value; },
        [&] { return content(sector, word) == value; });
  }

  /// How the latest erase or program ended.
  FlashResult result() const { return result_; }

 private:
  static bool inside(std::size_t sector, std::size_t word) {
    return sector < sector_count && word < words_per_sector;
  }
  std::uint32_t content(std::size_t sector, std::size_t word) const {
    return static_cast<std::uint32_t>(sectors_[sector].words[word]);
  }
  bool blank(std::size_t sector) const {
    for (std::size_t word = 0; word < words_per_sector; ++word)
      if (content(sector, word) != erased) return false;
    return true;
  }

  bool finish(FlashResult result) {
    result_ = result;
    return result == FlashResult::done;
  }

  bool idle_within(std::uint32_t polls) const {
    return wait_until(flash_.sr, flash_sr::Busy::mask, 0, polls);
  }

  bool run(std::uint32_t operation, std::uint32_t polls, auto start, auto verify) {
    if (!idle_within(waits_.erase)) return finish(FlashResult::busy);
    if (!unlock()) return finish(FlashResult::locked);
    const auto access_control = static_cast<std::uint32_t>(flash_.acr);
    flash_.acr = access_control & ~caches;
    flash_.sr = flash_sr::errors | flash_sr::EndOfOperation::mask;
    flash_.cr = operation | flash_cr::Parallelism::bits(flash_cr::by_word);
    start();
    // The store must have reached the flash before its status says anything.
    cortex_m::data_synchronization_barrier();
    const bool ended = idle_within(polls);
    const FlashResult outcome =
        ended ? decode(static_cast<std::uint32_t>(flash_.sr)) : FlashResult::timed_out;
    if (ended) lock();
    const bool verified = outcome == FlashResult::done && verify();
    restore_caches(access_control);
    return finish(outcome == FlashResult::done && !verified ? FlashResult::wrong_content : outcome);
  }

  /// A register found unlocked was left so by an operation that had timed out, or by a boot loader. The keys
  /// are not written then: they would count as a wrong sequence.
  bool unlock() {
    if (!flash_cr::Lock::read(flash_.cr)) return true;
    flash_.keyr = flash_key_1;
    flash_.keyr = flash_key_2;
    return !flash_cr::Lock::read(flash_.cr);
  }

  void lock() {
    flash_.cr = 0;
    flash_.cr = flash_cr::Lock::mask;
  }

  /// The reset bits act while the caches are off, which they are.
  void restore_caches(std::uint32_t access_control) {
    flash_.acr = (access_control & ~caches) | cache_resets;
    flash_.acr = access_control & ~caches;
    flash_.acr = access_control;
    cortex_m::data_synchronization_barrier();
    cortex_m::instruction_synchronization_barrier();
  }

  static FlashResult decode(std::uint32_t status) {
    if (flash_sr::WriteProtected::of(status) != 0) return FlashResult::write_protected;
    if (flash_sr::AlignmentError::of(status) != 0) return FlashResult::alignment_error;
    if (flash_sr::ParallelismError::of(status) != 0) return FlashResult::parallelism_error;
    if (flash_sr::SequenceError::of(status) != 0) return FlashResult::sequence_error;
    if (flash_sr::OperationError::of(status) != 0) return FlashResult::operation_error;
    return FlashResult::done;
  }

  static constexpr std::uint32_t caches = flash_acr::InstructionCache::mask | flash_acr::DataCache::mask;
  static constexpr std::uint32_t cache_resets =
      flash_acr::InstructionCacheReset::mask | flash_acr::DataCacheReset::mask;

  Flash& flash_;
  std::array<Sector, sector_count> sectors_;
  FlashWaits waits_;
  FlashResult result_ = FlashResult::done;
};

}  // namespace kmax::drivers::stm32f4
