#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Embedded flash interface, RM0090 chapter on the flash memory interface.

namespace kmax::drivers::stm32f4 {

struct FlashRegisters {
  volatile std::uint32_t acr;
  volatile std::uint32_t keyr;
  volatile std::uint32_t optkeyr;
  volatile std::uint32_t sr;
  volatile std::uint32_t cr;
  volatile std::uint32_t optcr;
};
static_assert(offsetof(FlashRegisters, acr) == 0x00);
static_assert(offsetof(FlashRegisters, keyr) == 0x04);
static_assert(offsetof(FlashRegisters, optkeyr) == 0x08);
static_assert(offsetof(FlashRegisters, sr) == 0x0C);
static_assert(offsetof(FlashRegisters, cr) == 0x10);
static_assert(offsetof(FlashRegisters, optcr) == 0x14);

inline constexpr std::uint32_t flash_interface_base = 0x4002'3C00;

inline FlashRegisters& flash() {
  return peripheral_at<FlashRegisters>(flash_interface_base);
}

namespace flash_acr {
using Latency = Field<0, 3>;  // wait states
using Prefetch = Field<8>;
using InstructionCache = Field<9>;
using DataCache = Field<10>;
using InstructionCacheReset = Field<11>;  // only while that cache is disabled; stays 1 until written 0
using DataCacheReset = Field<12>;         // likewise
}  // namespace flash_acr

/// Unlocks CR when both are written to KEYR in this order; anything else locks it until the next reset.
inline constexpr std::uint32_t flash_key_1 = 0x4567'0123;
inline constexpr std::uint32_t flash_key_2 = 0xCDEF'89AB;

namespace flash_sr {                // flags are cleared by writing 1
using EndOfOperation = Field<0>;    // EOP; only with EOPIE
using OperationError = Field<1>;    // OPERR; only with ERRIE
using WriteProtected = Field<4>;    // WRPERR
using AlignmentError = Field<5>;    // PGAERR: the store crosses a row of 128 bits
using ParallelismError = Field<6>;  // PGPERR: the store is not of the width that PSIZE says
using SequenceError = Field<7>;     // PGSERR: CR was not set up for what was tried
using Busy = Field<16>;             // BSY; read only
inline constexpr std::uint32_t errors = OperationError::mask | WriteProtected::mask | AlignmentError::mask |
                                        ParallelismError::mask | SequenceError::mask;
}  // namespace flash_sr

namespace flash_cr {
using Program = Field<0>;          // PG
using SectorErase = Field<1>;      // SER
using MassErase = Field<2>;        // MER
using Sector = Field<3, 4>;        // SNB
using Parallelism = Field<8, 2>;   // PSIZE
using Start = Field<16>;           // STRT
using EndInterrupt = Field<24>;    // EOPIE
using ErrorInterrupt = Field<25>;  // ERRIE
using Lock = Field<31>;
inline constexpr std::uint32_t by_word = 2;  // of Parallelism: 32 bits, at 2.7 to 3.6 V
}  // namespace flash_cr

namespace flash_optcr {
using BrownOutLevel =
    Field<2, 2>;  // BOR_LEV: held in reset below 2.7 V (0), 2.4 V (1), 2.1 V (2), 1.8 V (3: off)
}  // namespace flash_optcr

/// Main memory: 1 MiB in twelve sectors of 4 x 16, 64 and 7 x 128 KiB.
inline constexpr std::uint32_t flash_memory_base = 0x0800'0000;
inline constexpr unsigned flash_sector_count = 12;

/// `sector` 0 to 11.
constexpr std::uint32_t flash_sector_bytes(unsigned sector) {
  constexpr std::uint32_t kib = 1024;
  return sector < 4 ? 16 * kib : sector == 4 ? 64 * kib : 128 * kib;
}
/// From the start of main memory; `sector` 0 to 12, where 12 gives the size of the whole.
constexpr std::uint32_t flash_sector_offset(unsigned sector) {
  std::uint32_t offset = 0;
  for (unsigned before = 0; before < sector; ++before) offset += flash_sector_bytes(before);
  return offset;
}
static_assert(flash_sector_offset(1) == 0x4000);
static_assert(flash_sector_offset(5) == 0x2'0000);
static_assert(flash_sector_offset(flash_sector_count) == 0x10'0000);

}  // namespace kmax::drivers::stm32f4
