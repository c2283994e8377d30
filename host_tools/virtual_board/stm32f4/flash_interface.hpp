#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "drivers/stm32f4/registers/flash.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// The supply went away in the middle of an erase or of a programming operation: see FlashInterface.
class PowerCut : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The flash memory with its registers: RM0090, chapter Embedded Flash memory interface, sections Unlocking
/// the Flash control register, Program/erase parallelism, Erase, Programming, Flash interface registers.
/// Supply 2.7 to 3.6 V.
///
/// Keys: a wrong one is a bus error (refused) and locks CR until reset; keys to a CR that is not locked are
/// wrong. Programming clears bits and never sets one. An erase takes 250, 550 or 1000 ms by the sector's size
/// (16, 64, 128 KiB), a store 16 us (STM32F405 data sheet, typical at x32). The memory shows the result at
/// once, but until busy_until() the core gets no instruction and no data from flash: the board moves its time
/// there before it goes on. A system reset before then tears the operation.
///
/// A store without PG sets PGSERR (so does one while CR is locked, since PG cannot be set then), one of a
/// width other than PSIZE PGPERR, one to a protected sector WRPERR; nothing is programmed.
///
/// Refused: writing option bytes, mass erase, interrupts (EOPIE, ERRIE), parallelism 3 (needs Vpp), an erase
/// at other than x32, writing CR while it is locked (silicon ignores it) or busy (silicon stalls the bus),
/// too few wait states for HCLK, resetting a cache that is enabled, and starting an operation while error
/// flags are set.
class FlashInterface final : public RegisterBlock<FlashInterface> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::FlashRegisters);

  /// `image`: all of main memory, 1 MiB, as it is at 0x08000000. Throws std::invalid_argument for another
  /// size.
  FlashInterface(const BoardClocks& clocks, std::span<std::uint8_t> image);

  void reset(BoardTime now) override;

  /// A store of the processor to main memory; may throw PowerCut.
  void store(std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now);
  /// A load of data. Refused if the data cache may still hold what the memory held before an erase.
  std::uint32_t load(std::uint32_t address, unsigned bytes, BoardTime now) const;

  /// End of the latest operation; in the past when the flash is idle.
  BoardTime busy_until() const { return busy_until_; }
  std::uint32_t wait_states() const;
  /// Needed at an HCLK of that period (RM0090, relation between CPU clock frequency and Flash memory read
  /// time).
  static std::uint32_t wait_states_needed(BoardTime core_period);

  /// BOR_LEV of the option bytes, 0 to 3; as it leaves the factory it is off (3).
  void set_brown_out_level(std::uint32_t level) {
    optcr_ = (optcr_ & ~drivers::stm32f4::flash_optcr::BrownOutLevel::mask) |
             drivers::stm32f4::flash_optcr::BrownOutLevel::bits(level);
  }
  std::uint32_t brown_out_level() const { return drivers::stm32f4::flash_optcr::BrownOutLevel::of(optcr_); }
  /// As if the option bytes protected the sector.
  void set_write_protected(unsigned sector, bool write_protected);
  /// The operation after `operations - 1` more (each erase and each store is one) is left torn and throws
  /// PowerCut; from then on all accesses are refused. What is torn how follows from the seed: an erased
  /// sector holds old, erased and half-erased words, a stored word lacks some of its zeros; nothing and
  /// everything done occur too. 0: never.
  void cut_power_after(std::uint64_t operations, std::uint64_t seed);
  bool power_is_cut() const { return power_is_cut_; }
  /// As after power-up with the same memory; no cut is pending.
  void power_up(BoardTime now);
  /// Erases and stores so far.
  std::uint64_t operations() const { return operations_; }

 private:
  static const RegisterTable<FlashInterface>& registers();
  void before_access(const Access& /*access*/) override { require_power(); }
  std::uint32_t read_status(const Access& access) const;

  struct Operation {
    std::uint32_t offset;
    std::vector<std::uint8_t> before;
  };

  void write_access_control(const Access& access, std::uint32_t value);
  void write_key(const Access& access, std::uint32_t value);
  void write_control(const Access& access, std::uint32_t value);
  void start_erase(const Access& access);
  /// Remembers what the bytes held; called before they change.
  void begin(std::uint32_t offset, std::uint32_t bytes, BoardTime now, BoardTime duration);
  void cut_if_due();
  void tear();
  void require_power() const;
  std::uint32_t offset_of(std::uint32_t address, unsigned bytes) const;
  static unsigned sector_at(std::uint32_t offset);

  const BoardClocks& clocks_;
  std::span<std::uint8_t> image_;
  std::uint32_t acr_ = 0;
  std::uint32_t optcr_ = 0x0FFF'AAED;
  std::uint32_t sr_ = 0;  // without BSY, which follows from the time
  std::uint32_t cr_ = drivers::stm32f4::flash_cr::Lock::mask;
  bool first_key_given_ = false;
  bool locked_up_ = false;
  bool data_cache_is_stale_ = false;
  std::array<bool, drivers::stm32f4::flash_sector_count> write_protected_{};
  BoardTime busy_until_ = 0;
  std::optional<Operation> latest_;
  std::uint64_t operations_ = 0;
  std::uint64_t cut_at_ = 0;
  bool power_is_cut_ = false;
  std::mt19937_64 random_{1};
};

}  // namespace kmax::virtual_board
