#pragma once

#include <cstdint>

#include "drivers/cortex_m/registers.hpp"

// Core cycles, counted by the debug unit: what a piece of code costs, sleep included. ARMv7-M architecture
// reference manual, C1.8 (DWT). 32 bits wrap after 25 s at 168 MHz; differences stay right if what is
// measured is shorter. `now` is one load.

namespace kmax::drivers::cortex_m {

template <typename Dwt = DwtRegisters, typename CoreDebug = CoreDebugRegisters>
class CycleCounter {
 public:
  constexpr CycleCounter(Dwt& dwt, CoreDebug& core_debug) : dwt_(dwt), core_debug_(core_debug) {}

  /// Starts counting from 0. False where there is no such counter (some emulators); `now` then stands still.
  [[nodiscard]] bool start() {
    core_debug_demcr::TraceEnable::set(core_debug_.demcr);
    if (dwt_ctrl::NoCycleCounter::read(dwt_.ctrl) != 0) return false;
    dwt_.cyccnt = 0;
    dwt_ctrl::CycleCounterEnable::set(dwt_.ctrl);
    return dwt_ctrl::CycleCounterEnable::read(dwt_.ctrl) != 0;
  }

  std::uint32_t now() const { return static_cast<std::uint32_t>(dwt_.cyccnt); }
  std::uint32_t since(std::uint32_t start) const { return now() - start; }

 private:
  Dwt& dwt_;
  CoreDebug& core_debug_;
};

}  // namespace kmax::drivers::cortex_m
