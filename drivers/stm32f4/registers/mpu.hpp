#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Memory protection unit of the Cortex-M4, eight regions: PM0214, memory protection unit.

namespace kmax::drivers::stm32f4 {

inline constexpr unsigned mpu_region_count = 8;

struct MpuRegisters {
  volatile std::uint32_t type;
  volatile std::uint32_t ctrl;
  volatile std::uint32_t rnr;
  volatile std::uint32_t rbar;
  volatile std::uint32_t rasr;
  volatile std::uint32_t alias[6];  // RBAR and RASR three times more, for block writes
};
static_assert(offsetof(MpuRegisters, ctrl) == 0x04);
static_assert(offsetof(MpuRegisters, rnr) == 0x08);
static_assert(offsetof(MpuRegisters, rbar) == 0x0C);
static_assert(offsetof(MpuRegisters, rasr) == 0x10);
static_assert(sizeof(MpuRegisters) == 0x2C);

inline constexpr std::uint32_t mpu_base = 0xE000'ED90;

inline MpuRegisters& mpu() {
  return peripheral_at<MpuRegisters>(mpu_base);
}

namespace mpu_type {
using RegionCount = Field<8, 8>;  // DREGION
}  // namespace mpu_type

namespace mpu_ctrl {
using Enable = Field<0>;
using InFaultHandlers = Field<1>;    // HFNMIENA
using PrivilegedDefault = Field<2>;  // PRIVDEFENA: privileged code sees the rest of the map unprotected
}  // namespace mpu_ctrl

namespace mpu_rbar {
using Region = Field<0, 4>;  // taken over into RNR when Valid is written as 1
using Valid = Field<4>;
using Address = Field<5, 27>;
}  // namespace mpu_rbar

namespace mpu_rasr {
using Enable = Field<0>;
using Size = Field<1, 5>;  // the region has 2^(Size + 1) bytes, at least 32
using SubregionDisable = Field<8, 8>;
using Bufferable = Field<16>;
using Cacheable = Field<17>;
using Shareable = Field<18>;
using TypeExtension = Field<19, 3>;
using Permission = Field<24, 3>;  // AP
using ExecuteNever = Field<28>;
}  // namespace mpu_rasr

}  // namespace kmax::drivers::stm32f4
