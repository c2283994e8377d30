#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/dbgmcu.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board {

/// Debug support block: RM0090, chapter Debug support (DBG), section MCU debug component (DBGMCU). Identity
/// and the freeze bits, which are kept but do nothing, since no debugger ever halts the virtual board. Bits
/// of peripherals that the board does not have, and CR, are refused. System reset does not touch it.
class DbgmcuModel final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::DbgmcuRegisters);
  static constexpr std::uint32_t revision = 0x1007;  // revision 1 of the chip

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

 private:
  std::uint32_t apb1_fz_ = 0;
  std::uint32_t apb2_fz_ = 0;
};

}  // namespace kmax::virtual_board
