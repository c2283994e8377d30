#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/startup.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"

namespace kmax::drivers::cortex_m {

[[gnu::section(".boot.map_tick_code")]] void map_tick_code() {
  stm32f4::enable_peripheral_clock(stm32f4::rcc().apb2enr, stm32f4::rcc_apb2enr::SystemConfiguration::mask);
  stm32f4::syscfg().memrmp = stm32f4::syscfg_memrmp::MemoryAt0::bits(stm32f4::syscfg_memrmp::sram1);
  // Read back, so that the store is through the bus' bridge.
  static_cast<void>(static_cast<std::uint32_t>(stm32f4::syscfg().memrmp));
  data_synchronization_barrier();
  instruction_synchronization_barrier();
}

}  // namespace kmax::drivers::cortex_m
