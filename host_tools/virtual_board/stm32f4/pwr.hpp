#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/pwr.hpp"
#include "host_tools/virtual_board/peripheral.hpp"
#include "host_tools/virtual_board/stm32f4/board_clocks.hpp"

namespace kmax::virtual_board {

/// Power control: RM0090, chapter Power controller (PWR), section Voltage regulator. Only the voltage scale;
/// low-power modes, the voltage detector and the backup domain are refused.
///
/// Sources disagree on VOS after reset. It is 0 (scale 2) here, the case in which a program that forgets it
/// fails.
class PwrModel final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::PwrRegisters);
  /// Highest HCLK at scale 2 (STM32F405 data sheet, general operating conditions).
  static constexpr std::uint64_t scale_2_maximum_hz = 144'000'000;

  explicit PwrModel(const BoardClocks& clocks) : clocks_(clocks) {}

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

  bool voltage_scale_1() const;

 private:
  const BoardClocks& clocks_;
  std::uint32_t cr_ = 0;
};

}  // namespace kmax::virtual_board
