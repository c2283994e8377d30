#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// What the processor finds at each address: RM0090, memory map. Flash, SRAM and CCM are buffers of the host,
// which the processor's emulator reads and writes by itself; everything else is a block of registers that
// somebody has attached. An address without a block is refused.
//
// The parameter sectors 1 and 2 of flash are not plain memory: the processor reads them, but a store there is
// a programming operation and goes to `on_parameter_store`. Stores to the rest of flash are refused.
//
// At address 0 lies what SYSCFG_MEMRMP says: after a reset the vector table of flash, to which only load()
// leads, VTOR being 0; or SRAM1, for code to be fetched over the instruction bus. Stores there are refused.
// Bit-band aliases and the FSMC banks are not mapped.
//
// Cost: one array look-up per access to another block than the last (30 ns with the virtual call and the
// emulator's own part).

namespace kmax::virtual_board {

struct AddressRange {
  std::uint32_t base;
  std::uint32_t size;
  constexpr bool contains(std::uint32_t address) const { return address - base < size; }
};

namespace memory_map {
inline constexpr AddressRange flash{0x0800'0000, 1024 * 1024};
inline constexpr AddressRange parameters{0x0800'4000, 32 * 1024};
inline constexpr AddressRange sram{0x2000'0000, 128 * 1024};
/// The part of SRAM that can appear at address 0, and where it does.
inline constexpr AddressRange sram1{0x2000'0000, 112 * 1024};
inline constexpr AddressRange sram1_at_zero{0, sram1.size};
inline constexpr AddressRange ccm{0x1000'0000, 64 * 1024};
/// Where register blocks may be attached: system memory (unique id, option bytes), APB1 and APB2 and AHB1,
/// AHB2, and the core's own.
inline constexpr std::array register_areas{
    AddressRange{0x1FFF'0000, 64 * 1024}, AddressRange{0x4000'0000, 512 * 1024},
    AddressRange{0x5000'0000, 512 * 1024}, AddressRange{0xE000'0000, 1024 * 1024}};
}  // namespace memory_map

class Bus {
 public:
  /// A store of the processor to the parameter sectors; `value` holds `bytes` bytes.
  using ParameterStore =
      std::function<void(std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now)>;

  /// Flash erased (0xFF); SRAM and CCM filled with a pattern, since they are random after power-up.
  Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// Puts a block at [base, base + size), multiples of 4 inside one of the register areas. While `clocked` is
  /// given and false, every access is refused. Throws std::invalid_argument when the place is wrong or taken;
  /// the block must outlive the bus.
  void attach(std::uint32_t base, std::uint32_t size, std::string name, Peripheral& block,
              std::function<bool()> clocked = {});
  void on_parameter_store(ParameterStore store) { parameter_store_ = std::move(store); }

  /// Register access of the processor, also the parameter sectors. Throws RefusedAccess.
  std::uint32_t read(std::uint32_t address, unsigned bytes, BoardTime now);
  void write(std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now);

  /// Cycles of the core that register accesses would have waited for the bridges so far; nothing waits here.
  /// Assumed: 5 on APB2, which has half the core's clock, 10 on APB1, which has a quarter, 1 on AHB1.
  std::uint64_t register_waits() const { return register_waits_; }

  /// SYSCFG_MEMRMP. The processor follows before its next block.
  void show_sram_at_zero(bool shown) { sram_at_zero_ = shown; }
  bool sram_at_zero() const { return sram_at_zero_; }

  std::span<std::uint8_t> flash() { return flash_; }
  std::span<std::uint8_t> sram() { return sram_; }
  std::span<std::uint8_t> ccm() { return ccm_; }
  /// The bytes of memory at `address`; empty when they are not all in one memory. Flash may be changed this
  /// way (flashing, parameter programming), which the processor does not notice if it has run the code
  /// before.
  std::span<std::uint8_t> memory(std::uint32_t address, std::size_t size);

  /// A word of memory as the core itself loads it (vectors, stacked frames); none where there is no memory.
  std::optional<std::uint32_t> load(std::uint32_t address) const;
  /// False when there is no memory that can be written.
  bool store(std::uint32_t address, std::uint32_t value);

  /// Name of the block at an address, "" without one.
  std::string block_name(std::uint32_t address) const;

 private:
  struct Block {
    AddressRange range;
    std::string name;
    Peripheral* peripheral;
    std::function<bool()> clocked;
  };
  static constexpr unsigned page_shift = 10;
  /// Blocks that touch a page of 1 KiB: one, but for the core's own.
  using Page = std::vector<const Block*>;

  const Block* find(std::uint32_t address) const;
  const Block& block_for(std::uint32_t address, unsigned bytes) const;

  std::vector<std::uint8_t> flash_;
  std::vector<std::uint8_t> sram_;
  std::vector<std::uint8_t> ccm_;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::array<std::vector<Page>, memory_map::register_areas.size()> pages_;
  mutable const Block* last_found_ = nullptr;  ///< firmware often has several registers of a block in turn
  ParameterStore parameter_store_;
  std::uint64_t register_waits_ = 0;
  bool sram_at_zero_ = false;
};

}  // namespace kmax::virtual_board
