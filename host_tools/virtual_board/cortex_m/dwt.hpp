#pragma once

#include <cstdint>
#include <functional>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board {

/// The cycle counter of the data watchpoint and trace unit: ARMv7-M architecture reference manual, C1.8. CTRL
/// and CYCCNT; comparators, sampling and the event counters are refused. System reset does not touch it.
class DwtModel final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::DwtRegisters);

  /// `cycles`: core cycles executed since power-up. `trace_enabled`: DEMCR.TRCENA; while it is false all
  /// accesses are refused (unpredictable on silicon) and the counter stands still.
  DwtModel(std::function<std::uint64_t()> cycles, std::function<bool()> trace_enabled);

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

 private:
  std::uint32_t count() const;

  std::function<std::uint64_t()> cycles_;
  std::function<bool()> trace_enabled_;
  bool counting_ = false;
  std::uint32_t count_ = 0;  // at since_
  std::uint64_t since_ = 0;  // in cycles of the source
};

}  // namespace kmax::virtual_board
