#include "host_tools/virtual_board/stm32f4/pwr.hpp"

#include <cstddef>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
constexpr const char* block = "PWR";
}  // namespace

bool PwrModel::voltage_scale_1() const {
  return stm32::pwr_cr::VoltageScale1::of(cr_) != 0;
}

std::uint32_t PwrModel::read(const Access& access) {
  require_word(access, block);
  if (access.offset == offsetof(stm32::PwrRegisters, cr)) return cr_;
  if (access.offset == offsetof(stm32::PwrRegisters, csr)) return stm32::pwr_csr::VoltageScaleReady::mask;
  refuse(access, block, "no such register");
}

void PwrModel::write(const Access& access, std::uint32_t value) {
  require_word(access, block);
  if (access.offset != offsetof(stm32::PwrRegisters, cr))
    refuse(access, block, "only CR is modelled for writing");
  if ((value & ~stm32::pwr_cr::VoltageScale1::mask) != 0)
    refuse(access, block, "CR: only VOS (bit 14) is modelled");
  if (value == 0 && units_per_second / clocks_.core > scale_2_maximum_hz)
    refuse(access, block, "CR: voltage scale 2 with HCLK above 144 MHz");
  cr_ = value;
}

void PwrModel::reset(BoardTime) {
  cr_ = 0;
}

}  // namespace kmax::virtual_board
