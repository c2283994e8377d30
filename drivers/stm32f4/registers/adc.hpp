#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Analog-to-digital converters 1 to 3 and the registers they share, RM0090 chapter on ADC.

namespace kmax::drivers::stm32f4 {

struct AdcRegisters {
  volatile std::uint32_t sr;
  volatile std::uint32_t cr1;
  volatile std::uint32_t cr2;
  volatile std::uint32_t smpr1;  // channels 10 to 18
  volatile std::uint32_t smpr2;  // channels 0 to 9
  volatile std::uint32_t jofr[4];
  volatile std::uint32_t htr;
  volatile std::uint32_t ltr;
  volatile std::uint32_t sqr1;
  volatile std::uint32_t sqr2;
  volatile std::uint32_t sqr3;
  volatile std::uint32_t jsqr;
  volatile std::uint32_t jdr[4];
  volatile std::uint32_t dr;
};
static_assert(offsetof(AdcRegisters, sr) == 0x00);
static_assert(offsetof(AdcRegisters, cr1) == 0x04);
static_assert(offsetof(AdcRegisters, cr2) == 0x08);
static_assert(offsetof(AdcRegisters, smpr1) == 0x0C);
static_assert(offsetof(AdcRegisters, smpr2) == 0x10);
static_assert(offsetof(AdcRegisters, jofr) == 0x14);
static_assert(offsetof(AdcRegisters, htr) == 0x24);
static_assert(offsetof(AdcRegisters, ltr) == 0x28);
static_assert(offsetof(AdcRegisters, sqr1) == 0x2C);
static_assert(offsetof(AdcRegisters, sqr3) == 0x34);
static_assert(offsetof(AdcRegisters, jsqr) == 0x38);
static_assert(offsetof(AdcRegisters, jdr) == 0x3C);
static_assert(offsetof(AdcRegisters, dr) == 0x4C);

struct AdcCommonRegisters {
  volatile std::uint32_t csr;
  volatile std::uint32_t ccr;
  volatile std::uint32_t cdr;
};
static_assert(offsetof(AdcCommonRegisters, csr) == 0x00);
static_assert(offsetof(AdcCommonRegisters, ccr) == 0x04);
static_assert(offsetof(AdcCommonRegisters, cdr) == 0x08);

/// From one converter to the next, and from the third to the common registers.
inline constexpr std::uint32_t adc_base = 0x4001'2000;
inline constexpr std::uint32_t adc_stride = 0x100;

/// `number` 1 to 3.
inline AdcRegisters& adc(unsigned number) {
  return peripheral_at<AdcRegisters>(adc_base + adc_stride * (number - 1));
}
inline AdcCommonRegisters& adc_common() {
  return peripheral_at<AdcCommonRegisters>(adc_base + adc_stride * 3);
}

namespace adc_sr {                 // all cleared by writing 0
using AnalogWatchdog = Field<0>;   // AWD
using RegularEnd = Field<1>;       // EOC; also cleared by reading DR
using InjectedEnd = Field<2>;      // JEOC: the whole injected sequence
using InjectedStarted = Field<3>;  // JSTRT
using RegularStarted = Field<4>;   // STRT
using Overrun = Field<5>;          // OVR; regular group only
inline constexpr std::uint32_t all = 0x3FU;
}  // namespace adc_sr

namespace adc_cr1 {
using InjectedEndInterrupt = Field<7>;  // JEOCIE
using Scan = Field<8>;                  // needed for a sequence of more than one conversion
}  // namespace adc_cr1

namespace adc_cr2 {
using On = Field<0>;                             // ADON
using InjectedTrigger = Field<16, 4>;            // JEXTSEL
using InjectedTriggerEdge = Field<20, 2>;        // JEXTEN: 0 none, 1 rising, 2 falling, 3 both
using StartInjected = Field<22>;                 // JSWSTART; falls when the conversion starts
using StartRegular = Field<30>;                  // SWSTART; likewise
inline constexpr std::uint32_t timer1_trgo = 1;  // of InjectedTrigger
inline constexpr std::uint32_t rising = 1;       // of InjectedTriggerEdge
}  // namespace adc_cr2

namespace adc_sqr1 {
using LastIndex = Field<20, 4>;  // L: conversions of the regular group minus 1
}  // namespace adc_sqr1

namespace adc_sqr3 {
using First = Field<0, 5>;  // SQ1
}  // namespace adc_sqr3

namespace adc_jsqr {
using LastIndex = Field<20, 2>;  // JL: conversions of the injected group minus 1
using Channels = Field<0, 20>;   // JSQ1 to JSQ4, five bits each
inline constexpr std::uint32_t channel_mask = 0x1F;

/// Position of the channel of conversion `index` (0 first) in a list of `count` (1 to 4). The list ends at
/// JSQ4: a single conversion is JSQ4 and its result still JDR1.
constexpr unsigned position(unsigned index, unsigned count) {
  return 5 * (index + 4 - count);
}
}  // namespace adc_jsqr

namespace adc_ccr {
using Prescaler = Field<16, 2>;  // ADCPRE: 0 to 3 for /2, /4, /6, /8
}  // namespace adc_ccr

/// Sampling times in ADC clock cycles by the three-bit code of SMPR1 and SMPR2.
inline constexpr unsigned adc_sampling_cycles[8] = {3, 15, 28, 56, 84, 112, 144, 480};
/// Added to the sampling time for twelve bits.
inline constexpr unsigned adc_conversion_cycles = 12;
inline constexpr std::uint32_t adc_maximum_clock_hz = 36'000'000;  // STM32F405 data sheet, VDDA above 2.4 V
/// tSTAB, longest: from ADON to the first conversion (data sheet, ADC characteristics).
inline constexpr std::uint32_t adc_stabilization_us = 3;

/// Where a channel's sampling time is: SMPR2 for channels 0 to 9, SMPR1 for 10 to 18.
constexpr bool adc_sampling_in_smpr1(unsigned channel) {
  return channel >= 10;
}
constexpr unsigned adc_sampling_position(unsigned channel) {
  return 3 * (channel % 10);
}

/// External channels that the converter reaches on the 64-pin package: ADC3's channels 4 to 9, 14 and 15 are
/// on port F, which has no pins there.
constexpr bool adc_reaches(unsigned adc_number, unsigned channel) {
  if (channel > 15) return false;
  return adc_number != 3 || channel <= 3 || (channel >= 10 && channel <= 13);
}

}  // namespace kmax::drivers::stm32f4
