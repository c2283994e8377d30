#pragma once

#include <cstdint>
#include <functional>

#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// TIM2 as a pulse of channel 4: RM0090, chapter General-purpose timers (TIM2 to TIM5), section One-pulse
/// mode.
///
/// Modelled: one pulse (OPM) counting up from CNT to ARR, where CEN falls and CNT goes to 0; channel 4 in PWM
/// mode 2, high from CCR4 on, enabled by CC4E; UG. CEN written while it counts changes nothing.
///
/// Refused, since no driver uses it: counting without OPM, down or centre-aligned; a prescaler, other
/// channels and modes, preload, interrupts and DMA, an ARR or a CCR4 that is written while it counts.
class OnePulseTimerModel final : public RegisterBlock<OnePulseTimerModel> {
 public:
  explicit OnePulseTimerModel(const BoardClocks& clocks);

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  void reset(BoardTime now) override;

  /// Level of the channel's pin, if the port gives it to the timer.
  bool output() const { return output_; }
  void on_output_change(std::function<void(BoardTime)> listener) { changed_ = std::move(listener); }

 private:
  static const RegisterTable<OnePulseTimerModel>& registers();
  std::uint32_t read_cr1() const;
  std::uint32_t read_cnt(const Access& access) const { return count(access.now); }
  void write_cr1(const Access& access, std::uint32_t value);
  void write_egr(const Access& access, std::uint32_t value);
  void write_output(const Access& access, std::uint32_t value);
  void write_enable(const Access& access, std::uint32_t value);
  template <std::uint32_t OnePulseTimerModel::*word>
  void write_length(const Access& access, std::uint32_t value);
  std::uint32_t count(BoardTime now) const;
  void show(BoardTime now);

  const BoardClocks& clocks_;
  std::uint32_t cr1_ = 0, ccmr2_ = 0, ccer_ = 0, arr_ = 0xFFFF'FFFF, ccr4_ = 0, sr_ = 0, count_ = 0;
  bool running_ = false, output_ = false;
  BoardTime started_ = 0;  ///< with count_
  std::function<void(BoardTime)> changed_;
};

}  // namespace kmax::virtual_board
