#pragma once

#include <array>

#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/cortex_m/core_debug.hpp"
#include "host_tools/virtual_board/cortex_m/exception_table.hpp"
#include "host_tools/virtual_board/cortex_m/floating_point_control.hpp"
#include "host_tools/virtual_board/cortex_m/memory_protection.hpp"
#include "host_tools/virtual_board/cortex_m/nvic.hpp"
#include "host_tools/virtual_board/cortex_m/system_control.hpp"
#include "host_tools/virtual_board/cortex_m/system_tick.hpp"

// What the Cortex-M4 keeps at 0xE000E000: all blocks of the system control space, on the bus. PM0214, core
// peripherals. `system_tick` is the only one with events of its own.

namespace kmax::virtual_board {

struct CorePeripherals {
  CorePeripherals(Bus& bus, const BoardClocks& clocks)
      : nvic(exceptions),
        software_trigger(exceptions),
        system_control(exceptions),
        system_tick(clocks, exceptions) {
    namespace chip = drivers::stm32f4;
    bus.attach(drivers::cortex_m::nvic_base, Nvic::size, "NVIC", nvic);
    bus.attach(drivers::cortex_m::software_trigger_base, sizeof(drivers::cortex_m::SoftwareTriggerRegisters),
               "STIR", software_trigger);
    bus.attach(drivers::cortex_m::scb_base, SystemControl::size, "SCB", system_control);
    bus.attach(drivers::cortex_m::system_tick_base, SystemTick::size, "SysTick", system_tick);
    bus.attach(drivers::cortex_m::mpu_base, MemoryProtection::size, "MPU", memory_protection);
    bus.attach(drivers::cortex_m::floating_point_base, FloatingPointControl::size, "FPU control",
               floating_point);
    bus.attach(drivers::cortex_m::core_debug_base, CoreDebug::size, "core debug", core_debug);
  }

  /// System reset of all of them.
  void reset(BoardTime now) {
    exceptions.reset();
    const std::array<Peripheral*, 7> all{&nvic,        &software_trigger,  &system_control,
                                         &system_tick, &memory_protection, &floating_point,
                                         &core_debug};
    for (Peripheral* peripheral : all) peripheral->reset(now);
  }

  ExceptionTable exceptions;
  Nvic nvic;
  SoftwareTrigger software_trigger;
  SystemControl system_control;
  SystemTick system_tick;
  MemoryProtection memory_protection;
  FloatingPointControl floating_point;
  CoreDebug core_debug;
};

}  // namespace kmax::virtual_board
