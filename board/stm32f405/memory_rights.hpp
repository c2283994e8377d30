#pragma once

#include <algorithm>
#include <array>

#include "drivers/cortex_m/memory_protection.hpp"

namespace kmax::board {

/// What the program may do in which memory of the STM32F405 (RM0090, memory map); the places are those of
/// linker.ld. What is not named is forbidden, and what that catches is
/// - a stack that overflows: it grows towards the bottom of its memory. The bus has nothing below either, but
///   its error would come some instructions after a store, and without an address
/// - a null pointer, as far as 16 KiB from it: SRAM is at address 0, where the bus would let it load and
///   store
/// - code anywhere but in flash and where the tick's is, and stores to either outside the parameter sectors
inline constexpr auto memory_rights = std::to_array<drivers::cortex_m::ProtectedRegion>({
    {0x0800'0000, 20, drivers::cortex_m::MemoryRights::read_execute, drivers::cortex_m::MemoryKind::flash},
    // The parameter sectors 1 and 2, programmed by stores: 32 KiB in the middle of the first 64.
    {0x0800'0000, 16, drivers::cortex_m::MemoryRights::read_write, drivers::cortex_m::MemoryKind::flash,
     0b1100'0011},
    // System memory as far as the one-time-programmable bytes and the unique id; not the option bytes.
    {0x1FFF'0000, 15, drivers::cortex_m::MemoryRights::read, drivers::cortex_m::MemoryKind::flash},
    {0x1000'0000, 16, drivers::cortex_m::MemoryRights::read_write, drivers::cortex_m::MemoryKind::ram},
    // The tick's code as it is fetched: 48 KiB from 0x4000. As data, 0x2000'0000 further, it is out of reach.
    {0x0000'0000, 16, drivers::cortex_m::MemoryRights::read_execute, drivers::cortex_m::MemoryKind::ram,
     0b0000'0011},
    {0x2000'0000, 17, drivers::cortex_m::MemoryRights::read_write, drivers::cortex_m::MemoryKind::ram,
     0b0000'1110},
    {0x4000'0000, 29, drivers::cortex_m::MemoryRights::read_write,
     drivers::cortex_m::MemoryKind::peripherals},
});
static_assert(memory_rights.size() <= drivers::cortex_m::mpu_region_count);
static_assert(std::ranges::all_of(memory_rights, &drivers::cortex_m::ProtectedRegion::valid));

}  // namespace kmax::board
