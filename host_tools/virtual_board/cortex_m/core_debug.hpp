#pragma once

#include <cstdint>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Debug control of the core: TRCENA, which the cycle counter needs, and DHCSR, which says that no debugger is
// there. All else is a debugger's business and refused.

namespace kmax::virtual_board {

class CoreDebug final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::CoreDebugRegisters);

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime /*now*/) override {}  // a system reset leaves the debug registers alone

  bool trace_enabled() const { return demcr_ != 0; }

 private:
  std::uint32_t demcr_ = 0;
};

}  // namespace kmax::virtual_board
