#pragma once

#include <cstdint>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// FPCCR and its neighbours, PM0214 floating-point unit: how the FP registers survive an exception.
//
// Automatic preservation (ASPEN, on after reset) cannot be turned off here. Lazy preservation (LSPEN, on
// after reset) changes the modelled cycles alone: the registers always reach the stack at once, which no
// program can tell from the later write. FPDSCR other than 0 (round to nearest, no flush to zero) is refused.

namespace kmax::virtual_board {

class FloatingPointControl final : public Peripheral {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::FloatingPointRegisters);
  /// PM0214: single precision with division and square root, 16 double-word registers; fused multiply-add.
  static constexpr std::uint32_t feature_word_0 = 0x1011'0021;
  static constexpr std::uint32_t feature_word_1 = 0x1100'0011;

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void reset(BoardTime now) override;

  bool lazy() const { return drivers::cortex_m::floating_point_fpccr::LazyPreservation::of(fpccr_) != 0; }

  /// A frame with room for the registers was made, at this address, and they count as not yet written.
  void begin_lazy_frame(std::uint32_t address);
  void end_lazy_frame() { lazy_active_ = false; }
  bool lazy_active() const { return lazy_active_; }

 private:
  static constexpr std::uint32_t fpccr_reset =
      drivers::cortex_m::floating_point_fpccr::AutomaticPreservation::mask |
      drivers::cortex_m::floating_point_fpccr::LazyPreservation::mask;

  std::uint32_t fpccr_ = fpccr_reset;
  std::uint32_t fpcar_ = 0;
  bool lazy_active_ = false;
};

}  // namespace kmax::virtual_board
