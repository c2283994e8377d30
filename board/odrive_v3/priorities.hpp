#pragma once

#include <cstdint>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/stm32f4/interrupts.hpp"

// Who may interrupt whom, for the whole board: 0 is the most urgent, 15 the least.
//
//   0  lines     nFAULT and emergency stop: clear MOE of both bridges and leave a flag, or set it again if it
//                was interference. They may interrupt a tick; if that tick is just about to set MOE, it sees
//                the flag and clears MOE again
//   1  tick      the conversions' end: the control of one axis, 40,000 times a second
//   4  clock     SysTick at 1 kHz, the microsecond clock and the main loop's heartbeat
//   8  serial    one byte in, one byte out; CAN: one frame in, the next ones out; USB: packets either way
//
// The microsecond clock is exact only in contexts that do not outrank it: the lines and the tick never ask
// for the time.

namespace kmax::board::odrive_v3::priority {

inline constexpr std::uint8_t lines = 0;
inline constexpr std::uint8_t tick = 1;
inline constexpr std::uint8_t clock = 4;
inline constexpr std::uint8_t serial = 8;

static_assert(lines < tick && tick < clock && clock < serial);

struct OfInterrupt {
  drivers::stm32f4::Interrupt interrupt;
  std::uint8_t priority;
};
using drivers::stm32f4::Interrupt;
/// All that the board enables, SysTick aside. Read by tests/architecture/stack_depth.py as well, which adds
/// up what the interrupts need of the stack when each interrupts the next.
inline constexpr OfInterrupt all[] = {
    {Interrupt::exti2, lines},     {Interrupt::exti4, lines},     {Interrupt::adc, tick},
    {Interrupt::usart2, serial},   {Interrupt::can1_tx, serial},  {Interrupt::can1_rx0, serial},
    {Interrupt::can1_rx1, serial}, {Interrupt::can1_sce, serial}, {Interrupt::otg_fs, serial}};

/// Once, before any of them is enabled.
inline void set_all(drivers::cortex_m::InterruptController<>& interrupts) {
  interrupts.set_priority(drivers::cortex_m::SystemException::system_tick, clock);
  for (const auto& [interrupt, priority] : all) interrupts.set_priority(interrupt, priority);
}

}  // namespace kmax::board::odrive_v3::priority
