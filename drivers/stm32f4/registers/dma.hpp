#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Direct memory access, RM0090 chapter on the DMA controller: eight streams, each of which serves one of
// eight channels. DMA2 alone reaches the peripherals of APB2 and AHB1; neither reaches the CCM.

namespace kmax::drivers::stm32f4 {

struct DmaStreamRegisters {
  volatile std::uint32_t cr;
  volatile std::uint32_t ndtr;
  volatile std::uint32_t par;
  volatile std::uint32_t m0ar;
  volatile std::uint32_t m1ar;
  volatile std::uint32_t fcr;
};
struct DmaRegisters {
  volatile std::uint32_t lisr;
  volatile std::uint32_t hisr;
  volatile std::uint32_t lifcr;
  volatile std::uint32_t hifcr;
  DmaStreamRegisters stream[8];
};
static_assert(offsetof(DmaRegisters, lisr) == 0x00);
static_assert(offsetof(DmaRegisters, hisr) == 0x04);
static_assert(offsetof(DmaRegisters, lifcr) == 0x08);
static_assert(offsetof(DmaRegisters, hifcr) == 0x0C);
static_assert(offsetof(DmaRegisters, stream) == 0x10);
static_assert(offsetof(DmaStreamRegisters, cr) == 0x00);
static_assert(offsetof(DmaStreamRegisters, ndtr) == 0x04);
static_assert(offsetof(DmaStreamRegisters, par) == 0x08);
static_assert(offsetof(DmaStreamRegisters, m0ar) == 0x0C);
static_assert(offsetof(DmaStreamRegisters, m1ar) == 0x10);
static_assert(offsetof(DmaStreamRegisters, fcr) == 0x14);
static_assert(sizeof(DmaStreamRegisters) == 0x18);

inline constexpr std::uint32_t dma2_base = 0x4002'6400;

inline DmaRegisters& dma2() {
  return peripheral_at<DmaRegisters>(dma2_base);
}

namespace dma_cr {
using Enable = Field<0>;
using Direction = Field<6, 2>;                            // DIR
using Circular = Field<8>;                                // CIRC
using PeripheralSize = Field<11, 2>;                      // PSIZE
using MemorySize = Field<13, 2>;                          // MSIZE
using Priority = Field<16, 2>;                            // PL
using Channel = Field<25, 3>;                             // CHSEL
inline constexpr std::uint32_t memory_to_peripheral = 1;  // of Direction
inline constexpr std::uint32_t words = 2;                 // of the sizes
inline constexpr std::uint32_t very_high = 3;             // of Priority
}  // namespace dma_cr

/// A stream and the channel of a request: RM0090, DMA2 request mapping.
struct DmaRequest {
  unsigned stream, channel;
};
inline constexpr DmaRequest dma2_tim8_update{1, 7};
inline constexpr DmaRequest dma2_tim1_compare_4{4, 6};
inline constexpr DmaRequest dma2_tim8_compare_4{7, 7};

}  // namespace kmax::drivers::stm32f4
