#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// SysTick, the core's own 24-bit down-counter: PM0214, system timer.

namespace kmax::drivers::stm32f4 {

struct SystemTickRegisters {
  volatile std::uint32_t ctrl;
  volatile std::uint32_t load;
  volatile std::uint32_t val;
  volatile std::uint32_t calib;
};
static_assert(offsetof(SystemTickRegisters, ctrl) == 0x00);
static_assert(offsetof(SystemTickRegisters, load) == 0x04);
static_assert(offsetof(SystemTickRegisters, val) == 0x08);

static_assert(offsetof(SystemTickRegisters, calib) == 0x0C);

inline constexpr std::uint32_t system_tick_base = 0xE000'E010;

inline SystemTickRegisters& system_tick() {
  return peripheral_at<SystemTickRegisters>(system_tick_base);
}

namespace system_tick_ctrl {
using Enable = Field<0>;
using TickInterrupt = Field<1>;
using ProcessorClock = Field<2>;  // CLKSOURCE: 0 counts every eighth cycle of AHB
using CountFlag = Field<16>;      // COUNTFLAG: counted to 0 since the last read of this register
}  // namespace system_tick_ctrl

namespace system_tick_load {
using Reload = Field<0, 24>;
}  // namespace system_tick_load

namespace system_tick_calib {
using TenMilliseconds = Field<0, 24>;
using Skewed = Field<30>;       // the value above is not exact
using NoReference = Field<31>;  // no clock of its own
}  // namespace system_tick_calib

}  // namespace kmax::drivers::stm32f4
