#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Universal synchronous asynchronous receiver transmitter, RM0090 chapter on USART.

namespace kmax::drivers::stm32f4 {

struct UsartRegisters {
  volatile std::uint32_t sr;
  volatile std::uint32_t dr;
  volatile std::uint32_t brr;
  volatile std::uint32_t cr1;
  volatile std::uint32_t cr2;
  volatile std::uint32_t cr3;
  volatile std::uint32_t gtpr;
};
static_assert(offsetof(UsartRegisters, sr) == 0x00);
static_assert(offsetof(UsartRegisters, dr) == 0x04);
static_assert(offsetof(UsartRegisters, brr) == 0x08);
static_assert(offsetof(UsartRegisters, cr1) == 0x0C);
static_assert(offsetof(UsartRegisters, cr2) == 0x10);
static_assert(offsetof(UsartRegisters, cr3) == 0x14);
static_assert(offsetof(UsartRegisters, gtpr) == 0x18);

inline constexpr std::uint32_t usart2_base = 0x4000'4400;
inline constexpr std::uint32_t uart4_base = 0x4000'4C00;

inline UsartRegisters& usart2() {
  return peripheral_at<UsartRegisters>(usart2_base);
}
/// Has no clock line and no RTS/CTS; the same otherwise.
inline UsartRegisters& uart4() {
  return peripheral_at<UsartRegisters>(uart4_base);
}

namespace usart_sr {
using ParityError = Field<0>;           // PE
using FramingError = Field<1>;          // FE
using Noise = Field<2>;                 // NE
using Overrun = Field<3>;               // ORE
using Idle = Field<4>;                  // IDLE: a whole frame of ones after a byte
using ReceiveNotEmpty = Field<5>;       // RXNE
using TransmissionComplete = Field<6>;  // TC
using TransmitEmpty = Field<7>;         // TXE
}  // namespace usart_sr

namespace usart_cr1 {
using ReceiverEnable = Field<2>;                 // RE
using TransmitterEnable = Field<3>;              // TE
using IdleInterrupt = Field<4>;                  // IDLEIE
using ReceiveInterrupt = Field<5>;               // RXNEIE
using TransmissionCompleteInterrupt = Field<6>;  // TCIE
using TransmitEmptyInterrupt = Field<7>;         // TXEIE
using ParityErrorInterrupt = Field<8>;           // PEIE
using OddParity = Field<9>;                      // PS
using ParityEnable = Field<10>;                  // PCE
using NineBits = Field<12>;                      // M; counts the parity bit
using Enable = Field<13>;                        // UE
using OversamplingBy8 = Field<15>;               // OVER8
}  // namespace usart_cr1

namespace usart_cr2 {
using StopBits = Field<12, 2>;  // 0 = one, 2 = two
}  // namespace usart_cr2

namespace usart_cr3 {
using ReceiveDma = Field<6>;   // DMAR
using TransmitDma = Field<7>;  // DMAT
}  // namespace usart_cr3

}  // namespace kmax::drivers::stm32f4
