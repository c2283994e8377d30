#pragma once

#include <cstdint>

#include "drivers/stm32f4/core_instructions.hpp"
#include "drivers/stm32f4/registers/field.hpp"

namespace kmax::drivers::stm32f4 {

/// Switches on the peripheral clocks in `mask` of an RCC enable register (AHB1ENR, APB1ENR, ...) and leaves
/// the others.
///
/// The errata of the part ask for a pause between the enable and the first access to the peripheral (two AHB
/// cycles, or one plus the prescaler in APB cycles); a single dummy read has been reported as too short on an
/// F407. Hence: read back, barrier, read back again.
void enable_peripheral_clock(Register auto& enable_register, std::uint32_t mask) {
  enable_register = static_cast<std::uint32_t>(enable_register) | mask;
  static_cast<void>(static_cast<std::uint32_t>(enable_register));
  data_synchronization_barrier();
  static_cast<void>(static_cast<std::uint32_t>(enable_register));
}

}  // namespace kmax::drivers::stm32f4
