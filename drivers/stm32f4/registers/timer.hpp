#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Timers with capture/compare channels: RM0090, chapters Advanced-control timers (TIM1 and TIM8) and
// General-purpose timers (TIM2 to TIM5). One layout for all: TIM2 to TIM5 have no RCR and no BDTR, and the
// fields marked "advanced" are reserved there. TIM2 and TIM5 count 32 bits, the others 16.
//
// Channels are numbered from 1, as in the manual. `ccmr[0]` holds channels 1 and 2, `ccmr[1]` 3 and 4.

namespace kmax::drivers::stm32f4 {

struct TimerRegisters {
  volatile std::uint32_t cr1;
  volatile std::uint32_t cr2;
  volatile std::uint32_t smcr;
  volatile std::uint32_t dier;
  volatile std::uint32_t sr;
  volatile std::uint32_t egr;
  volatile std::uint32_t ccmr[2];
  volatile std::uint32_t ccer;
  volatile std::uint32_t cnt;
  volatile std::uint32_t psc;
  volatile std::uint32_t arr;
  volatile std::uint32_t rcr;  // advanced
  volatile std::uint32_t ccr[4];
  volatile std::uint32_t bdtr;  // advanced
  volatile std::uint32_t dcr;
  volatile std::uint32_t dmar;
};
static_assert(offsetof(TimerRegisters, cr1) == 0x00);
static_assert(offsetof(TimerRegisters, cr2) == 0x04);
static_assert(offsetof(TimerRegisters, smcr) == 0x08);
static_assert(offsetof(TimerRegisters, dier) == 0x0C);
static_assert(offsetof(TimerRegisters, sr) == 0x10);
static_assert(offsetof(TimerRegisters, egr) == 0x14);
static_assert(offsetof(TimerRegisters, ccmr) == 0x18);
static_assert(offsetof(TimerRegisters, ccer) == 0x20);
static_assert(offsetof(TimerRegisters, cnt) == 0x24);
static_assert(offsetof(TimerRegisters, psc) == 0x28);
static_assert(offsetof(TimerRegisters, arr) == 0x2C);
static_assert(offsetof(TimerRegisters, rcr) == 0x30);
static_assert(offsetof(TimerRegisters, ccr) == 0x34);
static_assert(offsetof(TimerRegisters, bdtr) == 0x44);
static_assert(offsetof(TimerRegisters, dcr) == 0x48);
static_assert(offsetof(TimerRegisters, dmar) == 0x4C);

inline constexpr std::uint32_t tim1_base = 0x4001'0000;
inline constexpr std::uint32_t tim8_base = 0x4001'0400;
inline constexpr std::uint32_t tim2_base = 0x4000'0000;
inline constexpr std::uint32_t tim3_base = 0x4000'0400;
inline constexpr std::uint32_t tim4_base = 0x4000'0800;
inline constexpr std::uint32_t tim5_base = 0x4000'0C00;

inline TimerRegisters& tim1() {
  return peripheral_at<TimerRegisters>(tim1_base);
}
inline TimerRegisters& tim8() {
  return peripheral_at<TimerRegisters>(tim8_base);
}
inline TimerRegisters& tim2() {
  return peripheral_at<TimerRegisters>(tim2_base);
}
inline TimerRegisters& tim3() {
  return peripheral_at<TimerRegisters>(tim3_base);
}
inline TimerRegisters& tim4() {
  return peripheral_at<TimerRegisters>(tim4_base);
}
inline TimerRegisters& tim5() {
  return peripheral_at<TimerRegisters>(tim5_base);
}

namespace timer_cr1 {
using Enable = Field<0>;               // CEN
using UpdateDisable = Field<1>;        // UDIS
using UpdateRequestSource = Field<2>;  // URS; 1 = UG does not set UIF
using OnePulse = Field<3>;             // OPM
using CountingDown = Field<4>;         // DIR; read-only in centre-aligned and encoder mode
/// CMS; 0 = edge, else centre, and CCxIF is set counting down (1), up (2) or both ways (3).
using Alignment = Field<5, 2>;
using AutoReloadPreload = Field<7>;  // ARPE
using ClockDivision = Field<8, 2>;   // CKD; clock of dead time and filters: 0 = /1, 1 = /2, 2 = /4
}  // namespace timer_cr1

namespace timer_cr2 {
using CapturePreload = Field<0>;                   // CCPC, advanced
using MasterMode = Field<4, 3>;                    // MMS, what TRGO shows
using IdleLevels = Field<8, 7>;                    // OIS1, OIS1N, OIS2, ... OIS4, advanced
inline constexpr std::uint32_t master_reset = 0;   // UG
inline constexpr std::uint32_t master_enable = 1;  // CEN
inline constexpr std::uint32_t master_update = 2;  // the update event
}  // namespace timer_cr2

namespace timer_smcr {
using SlaveMode = Field<0, 3>;         // SMS
using TriggerSelection = Field<4, 3>;  // TS; change only while SMS = 0
inline constexpr std::uint32_t slave_off = 0;
inline constexpr std::uint32_t slave_encoder_both_inputs = 3;  // four counts per line
inline constexpr std::uint32_t slave_trigger = 6;              // a rising edge sets CEN
inline constexpr std::uint32_t internal_trigger_0 = 0;         // ITR0: TIM1 for TIM8
}  // namespace timer_smcr

namespace timer_dier {
using UpdateInterrupt = Field<0>;  // UIE
template <unsigned channel>
using CaptureCompareInterrupt = Field<channel>;  // CC1IE to CC4IE
using BreakInterrupt = Field<7>;                 // BIE, advanced
using UpdateDma = Field<8>;                      // UDE
template <unsigned channel>
using CaptureCompareDma = Field<8 + channel>;  // CC1DE to CC4DE
}  // namespace timer_dier

/// Flags are cleared by writing 0; writing 1 leaves them.
namespace timer_sr {
using Update = Field<0>;  // UIF
template <unsigned channel>
using CaptureCompare = Field<channel>;  // CC1IF to CC4IF; reading CCRx clears it on a capture channel
using Trigger = Field<6>;               // TIF
using Break = Field<7>;                 // BIF, advanced
template <unsigned channel>
using Overcapture = Field<8 + channel>;  // CC1OF to CC4OF
}  // namespace timer_sr

namespace timer_egr {
using Update = Field<0>;  // UG
template <unsigned channel>
using CaptureCompare = Field<channel>;  // CC1G to CC4G
using Break = Field<7>;                 // BG, advanced; clears MOE
}  // namespace timer_egr

/// One byte for each channel.
namespace timer_ccmr {
inline constexpr unsigned bits_per_channel = 8;
template <unsigned channel>
inline constexpr unsigned shift = bits_per_channel*((channel - 1) % 2);
/// CCxS: 0 = output, 1 = input from the channel's own pin. Writable only while CCxE = 0.
template <unsigned channel>
using Selection = Field<shift<channel>, 2>;
// Output; without a mode the comparison acts on no pin, and still sets CCxIF.
template <unsigned channel>
using ComparePreload = Field<shift<channel> + 3>;  // OCxPE
template <unsigned channel>
using CompareMode = Field<shift<channel> + 4, 3>;  // OCxM
// Input:
template <unsigned channel>
using CapturePrescaler = Field<shift<channel> + 2, 2>;  // ICxPSC
template <unsigned channel>
using InputFilter = Field<shift<channel> + 4, 4>;  // ICxF

inline constexpr std::uint32_t input_of_own_pin = 1;
inline constexpr std::uint32_t pwm_mode_1 = 6;  // active below CCRx
inline constexpr std::uint32_t pwm_mode_2 = 7;  // active above CCRx
}  // namespace timer_ccmr

namespace timer_ccer {
inline constexpr unsigned bits_per_channel = 4;
template <unsigned channel>
using Enable = Field<bits_per_channel*(channel - 1)>;  // CCxE
template <unsigned channel>
using Polarity = Field<bits_per_channel*(channel - 1) + 1>;  // CCxP
template <unsigned channel>
using ComplementaryEnable = Field<bits_per_channel*(channel - 1) + 2>;  // CCxNE, advanced
template <unsigned channel>
using ComplementaryPolarity = Field<bits_per_channel*(channel - 1) + 3>;  // CCxNP
}  // namespace timer_ccer

/// Advanced only.
namespace timer_bdtr {
using DeadTime = Field<0, 8>;             // DTG, see dead_time.hpp
using Lock = Field<8, 2>;                 // LOCK; the first write to BDTR after reset decides
using IdleOffState = Field<10>;           // OSSI
using RunOffState = Field<11>;            // OSSR
using BreakEnable = Field<12>;            // BKE
using BreakActiveHigh = Field<13>;        // BKP
using AutomaticOutputEnable = Field<14>;  // AOE
using MainOutputEnable = Field<15>;       // MOE
}  // namespace timer_bdtr

}  // namespace kmax::drivers::stm32f4
