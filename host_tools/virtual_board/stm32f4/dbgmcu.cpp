#include "host_tools/virtual_board/stm32f4/dbgmcu.hpp"

#include <cstddef>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
namespace apb1 = stm32::dbgmcu_apb1_fz;
namespace apb2 = stm32::dbgmcu_apb2_fz;
constexpr const char* block = "DBGMCU";
constexpr std::uint32_t apb1_bits = apb1::Timer2::mask | apb1::Timer3::mask | apb1::Timer4::mask |
                                    apb1::Timer5::mask | apb1::IndependentWatchdog::mask | apb1::Can1::mask;
constexpr std::uint32_t apb2_bits = apb2::Timer1::mask | apb2::Timer8::mask;
}  // namespace

std::uint32_t DbgmcuModel::read(const Access& access) {
  require_word(access, block);
  switch (access.offset) {
    case offsetof(stm32::DbgmcuRegisters, idcode):
      return stm32::dbgmcu_idcode::Device::bits(stm32::dbgmcu_idcode::stm32f405) |
             stm32::dbgmcu_idcode::Revision::bits(revision);
    case offsetof(stm32::DbgmcuRegisters, cr):
      return 0;
    case offsetof(stm32::DbgmcuRegisters, apb1_fz):
      return apb1_fz_;
    case offsetof(stm32::DbgmcuRegisters, apb2_fz):
      return apb2_fz_;
    default:
      refuse(access, block, "no such register");
  }
}

void DbgmcuModel::write(const Access& access, std::uint32_t value) {
  require_word(access, block);
  if (access.offset == offsetof(stm32::DbgmcuRegisters, apb1_fz)) {
    if ((value & ~apb1_bits) != 0) refuse(access, block, "APB1_FZ: bit of a peripheral that is not modelled");
    apb1_fz_ = value;
  } else if (access.offset == offsetof(stm32::DbgmcuRegisters, apb2_fz)) {
    if ((value & ~apb2_bits) != 0) refuse(access, block, "APB2_FZ: bit of a peripheral that is not modelled");
    apb2_fz_ = value;
  } else {
    refuse(access, block, "not modelled for writing");
  }
}

void DbgmcuModel::reset(BoardTime) {}

}  // namespace kmax::virtual_board
