#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/registers/dbgmcu.hpp"
#include "drivers/stm32f4/registers/system_memory.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// What a virtual chip says about itself, and its board in the one-time programmable bytes.
struct Identity {
  std::array<std::uint32_t, 3> unique_id{0x0032'0021, 0x3335'5108, 0x3832'3436};
  std::uint16_t flash_kib = 1024;
  std::array<std::uint8_t, drivers::stm32f4::otp_bytes> one_time_programmable = [] {
    std::array<std::uint8_t, drivers::stm32f4::otp_bytes> blank;
    blank.fill(0xFF);
    return blank;
  }();
};

/// One-time programmable bytes, unique identifier and flash size: RM0090, chapters Embedded Flash memory
/// interface (one-time programmable bytes) and Device electronic signature. Read only, in any width. At
/// system_memory `base`.
class DeviceIdentity final : public Peripheral {
 public:
  static constexpr std::uint32_t base = drivers::stm32f4::otp_base;
  /// Up to and with the word that holds the flash size.
  static constexpr std::uint32_t size = (drivers::stm32f4::flash_size_base - base + 4) / 4 * 4;

  explicit DeviceIdentity(const Identity& identity = {});

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime /*now*/) override {}

 private:
  std::array<std::uint8_t, size> bytes_{};
  std::array<bool, size> known_{};
};

/// Debug support block: RM0090, chapter Debug support (DBG), section MCU debug component (DBGMCU). Identity
/// and the freeze bits, which count while a debugger halts the core (Stm32f405::halt). Bits of peripherals
/// that the board does not have, and CR, are refused. System reset does not touch it.
class DbgmcuModel final : public RegisterBlock<DbgmcuModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::DbgmcuRegisters);
  static constexpr std::uint32_t revision = 0x1007;  // revision 1 of the chip

  DbgmcuModel() : RegisterBlock("DBGMCU", registers()) {}
  void reset(BoardTime /*now*/) override {}

  bool freezes_on_apb1(std::uint32_t bits) const { return (apb1_fz_ & bits) != 0; }
  bool freezes_on_apb2(std::uint32_t bits) const { return (apb2_fz_ & bits) != 0; }

 private:
  static const RegisterTable<DbgmcuModel>& registers();

  std::uint32_t apb1_fz_ = 0;
  std::uint32_t apb2_fz_ = 0;
};

}  // namespace kmax::virtual_board
