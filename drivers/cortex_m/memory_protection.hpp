#pragma once

#include <cstdint>
#include <span>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"

// The memory protection unit of the Cortex-M4 as a list of what the program may do where: PM0214, memory
// protection unit. All that no region names is forbidden, to privileged code as well; the core's own
// peripherals (0xE000'0000) are always open. A violation is a precise fault with its address, of which the
// program gets a HardFault unless it enables MemManage.
//
// The unit is off in HardFault and NMI handlers: they must be able to work after a violation.

namespace kmax::drivers::cortex_m {

enum class MemoryRights : std::uint8_t { read, read_execute, read_write };

/// What the bus may do with accesses, the attributes that PM0214 recommends for such memory.
enum class MemoryKind : std::uint8_t { flash, ram, peripherals };

struct ProtectedRegion {
  std::uint32_t base;  ///< a multiple of its size
  unsigned size_log2;  ///< 5 (32 bytes) to 31
  MemoryRights rights;
  MemoryKind kind;
  std::uint8_t left_out = 0;  ///< bit n: the region's n-th eighth does not belong to it; from 256 bytes on

  constexpr bool valid() const {
    return size_log2 >= 5 && size_log2 < 32 && (base & ((1U << size_log2) - 1U)) == 0 &&
           (left_out == 0 || size_log2 >= 8);
  }

  constexpr std::uint32_t attributes() const {
    constexpr std::uint32_t privileged_read_only = 5, privileged_only = 1;
    const bool writable = rights == MemoryRights::read_write;
    return mpu_rasr::Enable::mask | mpu_rasr::Size::bits(size_log2 - 1) |
           mpu_rasr::SubregionDisable::bits(left_out) |
           mpu_rasr::Permission::bits(writable ? privileged_only : privileged_read_only) |
           (rights == MemoryRights::read_execute ? 0U : mpu_rasr::ExecuteNever::mask) |
           (kind == MemoryKind::peripherals ? mpu_rasr::Bufferable::mask : mpu_rasr::Cacheable::mask) |
           (kind == MemoryKind::flash ? 0U : mpu_rasr::Shareable::mask);
  }
};

/// Switches the protection on, from the next instruction. Where regions overlap the later one holds. At most
/// eight, all valid().
inline void protect_memory(MpuRegisters& unit, std::span<const ProtectedRegion> regions) {
  unit.ctrl = 0;
  for (unsigned number = 0; number < mpu_region_count; ++number) {
    unit.rnr = number;
    const bool used = number < regions.size();
    unit.rbar = used ? regions[number].base : 0U;
    unit.rasr = used ? regions[number].attributes() : 0U;
  }
  data_synchronization_barrier();
  unit.ctrl = mpu_ctrl::Enable::mask;
  data_synchronization_barrier();
  instruction_synchronization_barrier();
}

}  // namespace kmax::drivers::cortex_m
