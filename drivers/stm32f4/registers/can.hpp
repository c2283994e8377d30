#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Controller area network (bxCAN), RM0090 chapter on bxCAN, section CAN registers. Words only.

namespace kmax::drivers::stm32f4 {

inline constexpr unsigned can_transmit_mailboxes = 3;
inline constexpr unsigned can_fifos = 2;
inline constexpr unsigned can_fifo_depth = 3;
/// Shared by CAN1 and CAN2; CAN2SB says where CAN2's begin.
inline constexpr unsigned can_filter_banks = 28;

struct CanTransmitMailboxRegisters {
  volatile std::uint32_t tir;
  volatile std::uint32_t tdtr;
  volatile std::uint32_t tdlr;  // bytes 0 to 3, byte 0 lowest
  volatile std::uint32_t tdhr;  // bytes 4 to 7
};

struct CanReceiveMailboxRegisters {
  volatile std::uint32_t rir;
  volatile std::uint32_t rdtr;
  volatile std::uint32_t rdlr;
  volatile std::uint32_t rdhr;
};

struct CanFilterBankRegisters {
  volatile std::uint32_t fr1;
  volatile std::uint32_t fr2;
};

struct CanRegisters {
  volatile std::uint32_t mcr;
  volatile std::uint32_t msr;
  volatile std::uint32_t tsr;
  volatile std::uint32_t rfr[can_fifos];
  volatile std::uint32_t ier;
  volatile std::uint32_t esr;
  volatile std::uint32_t btr;
  std::uint32_t reserved_020[88];
  CanTransmitMailboxRegisters mailbox[can_transmit_mailboxes];
  CanReceiveMailboxRegisters fifo[can_fifos];
  std::uint32_t reserved_1d0[12];
  volatile std::uint32_t fmr;
  volatile std::uint32_t fm1r;  // a bit per bank: 0 identifier and mask, 1 two identifiers
  std::uint32_t reserved_208;
  volatile std::uint32_t fs1r;  // 0 two 16-bit filters, 1 one of 32 bits
  std::uint32_t reserved_210;
  volatile std::uint32_t ffa1r;  // which FIFO
  std::uint32_t reserved_218;
  volatile std::uint32_t fa1r;  // active
  std::uint32_t reserved_220[8];
  CanFilterBankRegisters bank[can_filter_banks];
};
static_assert(offsetof(CanRegisters, mcr) == 0x000);
static_assert(offsetof(CanRegisters, msr) == 0x004);
static_assert(offsetof(CanRegisters, tsr) == 0x008);
static_assert(offsetof(CanRegisters, rfr) == 0x00C);
static_assert(offsetof(CanRegisters, ier) == 0x014);
static_assert(offsetof(CanRegisters, esr) == 0x018);
static_assert(offsetof(CanRegisters, btr) == 0x01C);
static_assert(offsetof(CanRegisters, mailbox) == 0x180);
static_assert(offsetof(CanRegisters, fifo) == 0x1B0);
static_assert(offsetof(CanRegisters, fmr) == 0x200);
static_assert(offsetof(CanRegisters, fm1r) == 0x204);
static_assert(offsetof(CanRegisters, fs1r) == 0x20C);
static_assert(offsetof(CanRegisters, ffa1r) == 0x214);
static_assert(offsetof(CanRegisters, fa1r) == 0x21C);
static_assert(offsetof(CanRegisters, bank) == 0x240);
static_assert(sizeof(CanRegisters) == 0x320);

inline constexpr std::uint32_t can1_base = 0x4000'6400;

inline CanRegisters& can1() {
  return peripheral_at<CanRegisters>(can1_base);
}

namespace can_mcr {
using InitializationRequest = Field<0>;  // INRQ
using Sleep = Field<1>;                  // SLEEP
using TransmitFifoPriority = Field<2>;   // TXFP: 0 by identifier, 1 by order of request
using ReceiveFifoLocked = Field<3>;      // RFLM: 0 an overrun replaces the newest frame, 1 drops the new one
using NoRetransmission = Field<4>;       // NART
using AutomaticWakeUp = Field<5>;        // AWUM
using AutomaticBusOffRecovery = Field<6>;  // ABOM
using TimeTriggered = Field<7>;            // TTCM
using MasterReset = Field<15>;             // RESET; falls by itself
using DebugFreeze = Field<16>;             // DBF
inline constexpr std::uint32_t reset_value = Sleep::mask | DebugFreeze::mask;
}  // namespace can_mcr

namespace can_msr {
using Initialization = Field<0>;   // INAK
using Sleeping = Field<1>;         // SLAK
using ErrorInterrupt = Field<2>;   // ERRI; write 1 clears
using WakeUpInterrupt = Field<3>;  // WKUI; write 1 clears
using SleepInterrupt = Field<4>;   // SLAKI; write 1 clears
using Transmitting = Field<8>;     // TXM
using Receiving = Field<9>;        // RXM
using LastSample = Field<10>;      // SAMP
using ReceivePin = Field<11>;      // RX
}  // namespace can_msr

namespace can_tsr {
/// Bits of one mailbox (0 to 2), in its own byte.
template <unsigned mailbox>
using Byte = Field<8 * mailbox, 8>;
using RequestCompleted = Field<0>;  // RQCP; write 1 clears this and the three below
using TransmitOk = Field<1>;        // TXOK
using ArbitrationLost = Field<2>;   // ALST: of an attempt before
using TransmitError = Field<3>;     // TERR: likewise
using AbortRequest = Field<7>;      // ABRQ
constexpr unsigned position(unsigned mailbox) {
  return 8 * mailbox;
}

using MailboxCode = Field<24, 2>;  // CODE: the next free mailbox, or that of lowest priority
using Empty = Field<26, 3>;        // TME: a bit per mailbox
using Lowest = Field<29, 3>;       // LOW: likewise
inline constexpr std::uint32_t completed_all = 0x0001'0101;
inline constexpr std::uint32_t abort_all = 0x0080'8080;
}  // namespace can_tsr

namespace can_rfr {
using Pending = Field<0, 2>;  // FMP: frames in the FIFO
using Full = Field<3>;        // FULL; write 1 clears
using Overrun = Field<4>;     // FOVR; write 1 clears
using Release = Field<5>;     // RFOM; falls when the next frame is in front
}  // namespace can_rfr

namespace can_ier {
using TransmitMailboxEmpty = Field<0>;  // TMEIE
using Fifo0Pending = Field<1>;          // FMPIE0
using Fifo0Full = Field<2>;             // FFIE0
using Fifo0Overrun = Field<3>;          // FOVIE0
using Fifo1Pending = Field<4>;          // FMPIE1
using Fifo1Full = Field<5>;             // FFIE1
using Fifo1Overrun = Field<6>;          // FOVIE1
using ErrorWarning = Field<8>;          // EWGIE
using ErrorPassive = Field<9>;          // EPVIE
using BusOff = Field<10>;               // BOFIE
using LastErrorCode = Field<11>;        // LECIE
using Error = Field<15>;                // ERRIE
using WakeUp = Field<16>;               // WKUIE
using SleepEntered = Field<17>;         // SLKIE
}  // namespace can_ier

namespace can_esr {
using Warning = Field<0>;             // EWGF: TEC or REC >= 96
using Passive = Field<1>;             // EPVF: TEC or REC > 127
using BusOff = Field<2>;              // BOFF: TEC > 255
using LastErrorCode = Field<4, 3>;    // LEC: 0 none, 1 stuff, 2 form, 3 acknowledgement, 4 recessive bit,
                                      // 5 dominant bit, 6 CRC, 7 set by software
using TransmitErrors = Field<16, 8>;  // TEC
using ReceiveErrors = Field<24, 8>;   // REC
}  // namespace can_esr

namespace can_btr {              // all numbers minus 1; writable in initialization mode only
using Prescaler = Field<0, 10>;  // BRP
using Segment1 = Field<16, 4>;   // TS1
using Segment2 = Field<20, 3>;   // TS2
using JumpWidth = Field<24, 2>;  // SJW
using LoopBack = Field<30>;      // LBKM
using Silent = Field<31>;        // SILM
}  // namespace can_btr

/// TIR, RIR and, in 32-bit scale, both words of a filter bank. An identifier of 11 bits lies where the upper
/// 11 of one of 29 bits lie.
namespace can_identifier {
using TransmitRequest = Field<0>;  // TXRQ, in TIR alone
using Remote = Field<1>;           // RTR
using Extended = Field<2>;         // IDE
using ExtendedId = Field<3, 29>;   // with IDE
using StandardId = Field<21, 11>;  // without
}  // namespace can_identifier

namespace can_data_length {       // TDTR, RDTR
using Length = Field<0, 4>;       // DLC
using TransmitTime = Field<8>;    // TGT, in TDTR alone
using FilterIndex = Field<8, 8>;  // FMI, in RDTR alone
using Time = Field<16, 16>;       // TIME
}  // namespace can_data_length

namespace can_fmr {
using FilterInitialization = Field<0>;  // FINIT
using Can2FirstBank = Field<8, 6>;      // CAN2SB
inline constexpr std::uint32_t reset_value = 0x2A1C'0E01;
}  // namespace can_fmr

/// Banks that CAN1 has after reset, and keeps.
inline constexpr unsigned can1_filter_banks = can_fmr::Can2FirstBank::of(can_fmr::reset_value);
static_assert(can1_filter_banks == 14);

}  // namespace kmax::drivers::stm32f4
