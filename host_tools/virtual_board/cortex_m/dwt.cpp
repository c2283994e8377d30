#include "host_tools/virtual_board/cortex_m/dwt.hpp"

#include <cstddef>
#include <utility>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
constexpr const char* block = "DWT";
/// Four comparators (Cortex-M4 of the STM32F405), a cycle counter.
constexpr std::uint32_t fixed_bits = drivers::cortex_m::dwt_ctrl::Comparators::bits(4);
}  // namespace

DwtModel::DwtModel(std::function<std::uint64_t()> cycles, std::function<bool()> trace_enabled)
    : cycles_(std::move(cycles)), trace_enabled_(std::move(trace_enabled)) {}

std::uint32_t DwtModel::count() const {
  return counting_ ? count_ + static_cast<std::uint32_t>(cycles_() - since_) : count_;
}

std::uint32_t DwtModel::read(const Access& access) {
  require_word(access, block);
  if (!trace_enabled_()) refuse(access, block, "DEMCR.TRCENA is not set");
  if (access.offset == offsetof(drivers::cortex_m::DwtRegisters, ctrl))
    return fixed_bits | drivers::cortex_m::dwt_ctrl::CycleCounterEnable::bits(counting_ ? 1 : 0);
  if (access.offset == offsetof(drivers::cortex_m::DwtRegisters, cyccnt)) return count();
  refuse(access, block, "only CTRL and CYCCNT are modelled");
}

void DwtModel::write(const Access& access, std::uint32_t value) {
  require_word(access, block);
  if (!trace_enabled_()) refuse(access, block, "DEMCR.TRCENA is not set");
  if (access.offset == offsetof(drivers::cortex_m::DwtRegisters, ctrl)) {
    if ((value & ~(fixed_bits | drivers::cortex_m::dwt_ctrl::CycleCounterEnable::mask)) != 0)
      refuse(access, block, "CTRL: only CYCCNTENA is modelled");
    count_ = count();
    counting_ = drivers::cortex_m::dwt_ctrl::CycleCounterEnable::of(value) != 0;
  } else if (access.offset == offsetof(drivers::cortex_m::DwtRegisters, cyccnt)) {
    count_ = value;
  } else {
    refuse(access, block, "only CTRL and CYCCNT are modelled");
  }
  since_ = cycles_();
}

void DwtModel::reset(BoardTime) {}

}  // namespace kmax::virtual_board
