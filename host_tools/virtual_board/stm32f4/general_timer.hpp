#pragma once

#include <cstdint>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

enum class GeneralTimer : std::uint8_t { tim2, tim3, tim4, tim5 };

/// TIM2 to TIM5 as an encoder counter: RM0090, chapter General-purpose timers (TIM2 to TIM5). TIM2 and TIM5
/// count 32 bits, TIM3 and TIM4 16.
///
/// Modelled: encoder interface mode 3 (all edges of both inputs) with the direction by CC1P and CC2P, between
/// 0 and ARR; update event at the wrap with its flag; UG and URS. Input filters delay nothing (silicon: 143
/// ns with ICxF = 4 at 84 MHz); whoever makes short pulses asks for them.
///
/// Refused, since no driver uses it: counting by the clock, encoder modes 1 and 2 and all other slave modes,
/// a prescaler, interrupts and DMA, capture and compare channels, changing the inputs while counting.
class GeneralTimerModel final : public RegisterBlock<GeneralTimerModel> {
 public:
  GeneralTimerModel(GeneralTimer unit, const BoardClocks& clocks);

  void reset(BoardTime now) override;

  /// Edges of A and B together since some origin of the world's choice, upwards when A leads. The counter
  /// follows the changes while it is in encoder mode and runs. Its cost does not depend on how far it moved.
  void set_encoder_count(std::int64_t edges);
  /// s: shorter pulses of A and B are not counted.
  double input_filter() const;

 private:
  static const RegisterTable<GeneralTimerModel>& registers();
  std::uint32_t read_cr1() const;
  void write_cr1(const Access& access, std::uint32_t value);
  void write_smcr(const Access& access, std::uint32_t value);
  void write_egr(std::uint32_t value);
  void write_inputs(const Access& access, std::uint32_t value);
  void write_ccer(const Access& access, std::uint32_t value);
  void write_cnt(const Access& access, std::uint32_t value);
  void write_arr(const Access& access, std::uint32_t value);
  bool encoder_mode() const;

  const BoardClocks& clocks_;
  std::uint32_t longest_;  // greatest count
  std::uint32_t cr1_ = 0;  // without CEN and DIR
  std::uint32_t smcr_ = 0, sr_ = 0, ccmr_ = 0, ccer_ = 0, arr_ = 0, count_ = 0;
  bool running_ = false;
  bool down_ = false;  // DIR
  std::int64_t edges_ = 0;
};

}  // namespace kmax::virtual_board
