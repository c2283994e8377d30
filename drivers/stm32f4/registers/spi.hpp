#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Serial peripheral interface, RM0090 chapter on SPI, section SPI and I2S registers.

namespace kmax::drivers::stm32f4 {

struct SpiRegisters {
  volatile std::uint32_t cr1;
  volatile std::uint32_t cr2;
  volatile std::uint32_t sr;
  volatile std::uint32_t dr;
  volatile std::uint32_t crcpr;
  volatile std::uint32_t rxcrcr;
  volatile std::uint32_t txcrcr;
  volatile std::uint32_t i2scfgr;
  volatile std::uint32_t i2spr;
};
static_assert(offsetof(SpiRegisters, cr1) == 0x00);
static_assert(offsetof(SpiRegisters, cr2) == 0x04);
static_assert(offsetof(SpiRegisters, sr) == 0x08);
static_assert(offsetof(SpiRegisters, dr) == 0x0C);
static_assert(offsetof(SpiRegisters, i2spr) == 0x20);

inline constexpr std::uint32_t spi3_base = 0x4000'3C00;

inline SpiRegisters& spi3() {
  return peripheral_at<SpiRegisters>(spi3_base);
}

namespace spi_cr1 {
using SecondEdge = Field<0>;             // CPHA: data is sampled at the second edge of the clock
using IdleHigh = Field<1>;               // CPOL
using Master = Field<2>;                 // MSTR
using Prescaler = Field<3, 3>;           // BR: 0 to 7 for /2 to /256
using Enable = Field<6>;                 // SPE
using LeastSignificantFirst = Field<7>;  // LSBFIRST
using InternalSelect = Field<8>;         // SSI: the level that NSS would have, with SSM
using SoftwareSelect = Field<9>;         // SSM
using ReceiveOnly = Field<10>;           // RXONLY
using SixteenBits = Field<11>;           // DFF
using CrcNext = Field<12>;               // CRCNEXT
using CrcEnable = Field<13>;             // CRCEN
using BidirectionalOutput = Field<14>;   // BIDIOE
using Bidirectional = Field<15>;         // BIDIMODE

/// Peripheral clocks per bit, by the code of Prescaler.
constexpr std::uint32_t divider(std::uint32_t code) {
  return 2U << code;
}
}  // namespace spi_cr1

namespace spi_cr2 {
using ReceiveDma = Field<0>;              // RXDMAEN
using TransmitDma = Field<1>;             // TXDMAEN
using SelectOutput = Field<2>;            // SSOE
using ErrorInterrupt = Field<5>;          // ERRIE
using ReceiveInterrupt = Field<6>;        // RXNEIE
using TransmitEmptyInterrupt = Field<7>;  // TXEIE
}  // namespace spi_cr2

namespace spi_sr {
using ReceiveNotEmpty = Field<0>;  // RXNE; cleared by reading DR
using TransmitEmpty = Field<1>;    // TXE; cleared by writing DR
using CrcError = Field<4>;         // CRCERR
using ModeFault = Field<5>;        // MODF
using Overrun = Field<6>;          // OVR; cleared by reading DR, then SR
using Busy = Field<7>;             // BSY
}  // namespace spi_sr

}  // namespace kmax::drivers::stm32f4
