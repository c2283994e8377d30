#pragma once

#include <cstdint>

#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/run/flash_accelerator.hpp"

namespace kmax::virtual_board {

/// For how many cycles one tick waits for memory: for flash, which FlashAccelerator models in both readings
/// of the manual; and for SRAM1 while code is fetched from it (RM0090, bus matrix: one master at a time), a
/// cycle for each load and store of data there. The latter is an upper bound: the core fetches in advance, so
/// that not each of them meets a fetch. `cycles` are those of the tick so far, without waits.
class MemoryWaits {
 public:
  /// An instruction of `bytes`.
  void fetch(std::uint32_t address, std::uint32_t bytes, std::uint64_t cycles) {
    if (!memory_map::flash.contains(address)) return;
    ++flash_reads_;
    waits_ += missed_kept_.fetch(address, bytes, cycles + waits_);
    waits_if_all_kept_ += all_kept_.fetch(address, bytes, cycles + waits_if_all_kept_);
  }
  /// A load or store of data by the instruction at `fetched`.
  void access(std::uint32_t address, std::uint32_t fetched, std::uint64_t cycles) {
    if (memory_map::flash.contains(address)) {
      ++flash_reads_;
      waits_ += missed_kept_.load(address, cycles + waits_);
      waits_if_all_kept_ += all_kept_.load(address, cycles + waits_if_all_kept_);
    } else if (is_sram1(address) && is_sram1(fetched)) {
      ++for_sram_;
    }
  }

  std::uint64_t for_flash() const { return waits_; }
  std::uint64_t for_flash_if_all_kept() const { return waits_if_all_kept_; }
  std::uint64_t for_sram() const { return for_sram_; }
  /// Instructions and data.
  std::uint64_t flash_reads() const { return flash_reads_; }

 private:
  static bool is_sram1(std::uint32_t address) {
    return memory_map::sram1.contains(address) || memory_map::sram1_at_zero.contains(address);
  }

  FlashAccelerator missed_kept_, all_kept_{FlashAccelerator::Kept::all};
  std::uint64_t waits_ = 0, waits_if_all_kept_ = 0, for_sram_ = 0, flash_reads_ = 0;
};

}  // namespace kmax::virtual_board
