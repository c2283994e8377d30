#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Reset and clock control, RM0090 chapter on RCC; the part that the firmware uses.

namespace kmax::drivers::stm32f4 {

struct RccRegisters {
  volatile std::uint32_t cr;
  volatile std::uint32_t pllcfgr;
  volatile std::uint32_t cfgr;
  volatile std::uint32_t cir;
  volatile std::uint32_t ahb1rstr;
  volatile std::uint32_t ahb2rstr;
  volatile std::uint32_t ahb3rstr;
  std::uint32_t reserved_1c;
  volatile std::uint32_t apb1rstr;
  volatile std::uint32_t apb2rstr;
  std::uint32_t reserved_28[2];
  volatile std::uint32_t ahb1enr;
  volatile std::uint32_t ahb2enr;
  volatile std::uint32_t ahb3enr;
  std::uint32_t reserved_3c;
  volatile std::uint32_t apb1enr;
  volatile std::uint32_t apb2enr;
  std::uint32_t reserved_48[10];
  volatile std::uint32_t bdcr;
  volatile std::uint32_t csr;
};
static_assert(offsetof(RccRegisters, cr) == 0x00);
static_assert(offsetof(RccRegisters, pllcfgr) == 0x04);
static_assert(offsetof(RccRegisters, cfgr) == 0x08);
static_assert(offsetof(RccRegisters, ahb1rstr) == 0x10);
static_assert(offsetof(RccRegisters, apb1rstr) == 0x20);
static_assert(offsetof(RccRegisters, apb2rstr) == 0x24);
static_assert(offsetof(RccRegisters, ahb1enr) == 0x30);
static_assert(offsetof(RccRegisters, ahb2enr) == 0x34);
static_assert(offsetof(RccRegisters, apb1enr) == 0x40);
static_assert(offsetof(RccRegisters, apb2enr) == 0x44);
static_assert(offsetof(RccRegisters, csr) == 0x74);

inline RccRegisters& rcc() {
  return peripheral_at<RccRegisters>(0x4002'3800);
}

namespace rcc_cr {
using InternalOn = Field<0>;     // HSION
using InternalReady = Field<1>;  // HSIRDY
using CrystalOn = Field<16>;     // HSEON
using CrystalReady = Field<17>;  // HSERDY
using PllOn = Field<24>;
using PllReady = Field<25>;
}  // namespace rcc_cr

namespace rcc_pllcfgr {
using InputDivider = Field<0, 6>;    // M
using Multiplier = Field<6, 9>;      // N
using OutputDivider = Field<16, 2>;  // P; 0 means 2
using FromCrystal = Field<22>;       // PLLSRC
using UsbDivider = Field<24, 4>;     // Q
}  // namespace rcc_pllcfgr

namespace rcc_cfgr {
using Switch = Field<0, 2>;          // SW: 0 HSI, 1 HSE, 2 PLL
using SwitchStatus = Field<2, 2>;    // SWS, same code
using AhbPrescaler = Field<4, 4>;    // 0 = /1
using Apb1Prescaler = Field<10, 3>;  // 0 = /1, 4 = /2, 5 = /4
using Apb2Prescaler = Field<13, 3>;
}  // namespace rcc_cfgr

namespace rcc_ahb1enr {
using GpioA = Field<0>;
using GpioB = Field<1>;
using GpioC = Field<2>;
using GpioD = Field<3>;
}  // namespace rcc_ahb1enr

namespace rcc_apb1enr {
using Usart2 = Field<17>;
using Power = Field<28>;
}  // namespace rcc_apb1enr

}  // namespace kmax::drivers::stm32f4
