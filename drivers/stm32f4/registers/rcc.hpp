#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/register_field.hpp"

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
static_assert(offsetof(RccRegisters, cir) == 0x0C);
static_assert(offsetof(RccRegisters, ahb1rstr) == 0x10);
static_assert(offsetof(RccRegisters, ahb2rstr) == 0x14);
static_assert(offsetof(RccRegisters, apb1rstr) == 0x20);
static_assert(offsetof(RccRegisters, apb2rstr) == 0x24);
static_assert(offsetof(RccRegisters, ahb1enr) == 0x30);
static_assert(offsetof(RccRegisters, ahb2enr) == 0x34);
static_assert(offsetof(RccRegisters, apb1enr) == 0x40);
static_assert(offsetof(RccRegisters, apb2enr) == 0x44);
static_assert(offsetof(RccRegisters, csr) == 0x74);

inline constexpr std::uint32_t rcc_base = 0x4002'3800;

inline RccRegisters& rcc() {
  return peripheral_at<RccRegisters>(rcc_base);
}

namespace rcc_cr {
using InternalOn = Field<0>;              // HSION
using InternalReady = Field<1>;           // HSIRDY
using InternalTrim = Field<3, 5>;         // HSITRIM; reset value 16
using InternalCalibration = Field<8, 8>;  // HSICAL; of the individual chip, read only
using CrystalOn = Field<16>;              // HSEON
using CrystalReady = Field<17>;           // HSERDY
using CrystalBypass = Field<18>;          // HSEBYP
using ClockSecurity = Field<19>;          // CSSON
using PllOn = Field<24>;
using PllReady = Field<25>;
}  // namespace rcc_cr

namespace rcc_pllcfgr {
using InputDivider = Field<0, 6>;    // M
using Multiplier = Field<6, 9>;      // N
using OutputDivider = Field<16, 2>;  // P; 0 means 2
using FromCrystal = Field<22>;       // PLLSRC
using UsbDivider = Field<24, 4>;     // Q
using Reserved29 = Field<29>;        // resets to 1; vendor code writes it 0
inline constexpr std::uint32_t reset_value = 0x2400'3010;
}  // namespace rcc_pllcfgr

namespace rcc_cfgr {
using Switch = Field<0, 2>;          // SW: 0 HSI, 1 HSE, 2 PLL
using SwitchStatus = Field<2, 2>;    // SWS, same code
using AhbPrescaler = Field<4, 4>;    // 0 = /1
using Apb1Prescaler = Field<10, 3>;  // 0 = /1, 4 = /2, 5 = /4
using Apb2Prescaler = Field<13, 3>;

inline constexpr std::uint32_t internal = 0, crystal = 1, pll = 2;  // of Switch and SwitchStatus
}  // namespace rcc_cfgr

namespace rcc_cir {
using ClockSecurityFlag = Field<7>;    // CSSF: the crystal has failed; raises the NMI until cleared
using ClockSecurityClear = Field<23>;  // CSSC: write 1
}  // namespace rcc_cir

namespace rcc_ahb1enr {
using GpioA = Field<0>;
using GpioB = Field<1>;
using GpioC = Field<2>;
using GpioD = Field<3>;
using Ccm = Field<20>;  // CCMDATARAMEN; the only one that is on after reset
using Dma2 = Field<22>;
}  // namespace rcc_ahb1enr

namespace rcc_ahb2enr {
using OtgFs = Field<7>;  // OTGFSEN
}  // namespace rcc_ahb2enr

namespace rcc_apb1enr {
using Timer2 = Field<0>;
using Timer3 = Field<1>;
using Timer4 = Field<2>;
using Timer5 = Field<3>;
using Spi3 = Field<15>;
using Usart2 = Field<17>;
using Uart4 = Field<19>;
using Can1 = Field<25>;
using Power = Field<28>;
}  // namespace rcc_apb1enr

namespace rcc_apb2enr {
using Timer1 = Field<0>;
using Timer8 = Field<1>;
using Adc1 = Field<8>;
using Adc2 = Field<9>;
using Adc3 = Field<10>;
using SystemConfiguration = Field<14>;
}  // namespace rcc_apb2enr

/// The reset registers use the bit numbers of the enable registers, but for the three ADCs, which have one.
namespace rcc_apb2rstr {
using Adc = Field<8>;
}  // namespace rcc_apb2rstr

namespace rcc_csr {
using LowSpeedOn = Field<0>;     // LSION
using LowSpeedReady = Field<1>;  // LSIRDY
using RemoveFlags = Field<24>;   // RMVF: write 1, clears all that follow
using BrownOut = Field<25>;      // BORRSTF; also set by a power-on reset
using Pin = Field<26>;           // PINRSTF; set by every reset, since each one pulls NRST low from inside
using PowerOn = Field<27>;       // PORRSTF
using Software = Field<28>;      // SFTRSTF
using IndependentWatchdog = Field<29>;
using WindowWatchdog = Field<30>;
using LowPower = Field<31>;
}  // namespace rcc_csr

/// Switches on the peripheral clocks in `mask` of an RCC enable register (AHB1ENR, APB1ENR, ...) and leaves
/// the others.
///
/// The errata of the part ask for a pause between the enable and the first access to the peripheral (two AHB
/// cycles, or one plus the prescaler in APB cycles); a single dummy read has been reported as too short on an
/// F407. Hence: read back, barrier, read back again.
void enable_peripheral_clock(Register auto& enable_register, std::uint32_t mask) {
  enable_register = static_cast<std::uint32_t>(enable_register) | mask;
  static_cast<void>(static_cast<std::uint32_t>(enable_register));
  cortex_m::data_synchronization_barrier();
  static_cast<void>(static_cast<std::uint32_t>(enable_register));
}

}  // namespace kmax::drivers::stm32f4
