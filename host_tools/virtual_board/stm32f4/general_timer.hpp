#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"
#include "host_tools/virtual_board/stm32f4/timer_channels.hpp"

namespace kmax::virtual_board {

enum class GeneralTimer : std::uint8_t { tim2, tim3, tim4, tim5 };

/// TIM2 to TIM5 as an encoder counter or as a free-running time base: RM0090, chapter General-purpose timers
/// (TIM2 to TIM5). TIM2 and TIM5 count 32 bits, TIM3 and TIM4 16.
///
/// Modelled: encoder interface mode 3 (all edges of both inputs) with the direction by CC1P and CC2P;
/// up-counting with PSC and ARR, both preloaded as CR1 says (a period of 2^32 ticks with ARR = 0xFFFFFFFF);
/// update event at the wrap, UIF and its interrupt; UG and URS; input capture on all four channels with its
/// interrupt, overcapture, polarity. Input filters are accepted and delay nothing (silicon: 143 ns with ICxF
/// = 4 at 84 MHz).
///
/// Refused: encoder modes 1 and 2, down-counting, centre alignment, UDIS, OPM, all other slave modes, MMS
/// other than 0, DMA, compare outputs, capture prescalers, changing SMS while counting.
///
/// The wrap is an event of the board only while it can raise the update interrupt.
class GeneralTimerModel final : public RegisterBlock<GeneralTimerModel> {
 public:
  GeneralTimerModel(GeneralTimer unit, const BoardClocks& clocks, InterruptLines& interrupts);

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  void reset(BoardTime now) override;

  /// Edges of A and B together since some origin of the world's choice, upwards when A leads. The counter
  /// follows the changes while it is in encoder mode and runs. Its cost does not depend on how far it moved.
  void set_encoder_count(std::int64_t edges);
  /// An edge on the pin of a channel, 1 to 4. Ignored unless that channel captures and selects this edge.
  void capture_edge(unsigned channel, bool rising, BoardTime now);
  /// To be called when BoardClocks::apb1_timer has changed. Without it the change is noticed at the next
  /// access or event.
  void clock_changed(BoardTime now);

 private:
  static const RegisterTable<GeneralTimerModel>& registers();
  std::uint32_t read_cr1() const;
  void write_cr1(const Access& access, std::uint32_t value);
  void write_smcr(const Access& access, std::uint32_t value);
  void write_egr(const Access& access, std::uint32_t value);
  void write_ccmr(const Access& access, unsigned index, std::uint32_t value);
  void write_ccer(const Access& access, std::uint32_t value);
  std::uint32_t read_cnt(const Access& access) const { return count(access.now); }
  void write_cnt(const Access& access, std::uint32_t value);
  void write_arr(const Access& access, std::uint32_t value);
  std::uint32_t read_capture(unsigned channel);
  void require_encoder_inputs(const Access& access) const;
  void after_write() override { update_interrupt(); }

  bool encoder_mode() const;
  bool reversed() const;
  BoardTime tick() const { return clocks_.apb1_timer * (BoardTime{psc_.active} + 1); }
  std::uint32_t count(BoardTime now) const;
  void count_from(BoardTime now, std::uint32_t count);
  void start(BoardTime now);
  void stop(BoardTime now);
  void load_preloaded();
  void software_update(BoardTime now);
  void flag_update();
  void update_interrupt();
  bool captures(unsigned channel) const;

  drivers::stm32f4::Interrupt interrupt_;
  std::uint32_t longest_;  // greatest count
  const BoardClocks& clocks_;
  InterruptLines& interrupts_;

  std::uint32_t cr1_ = 0;  // without CEN and DIR
  std::uint32_t smcr_ = 0, dier_ = 0, sr_ = 0, ccer_ = 0;
  std::array<std::uint32_t, 2> ccmr_{};
  PreloadedWord psc_, arr_;
  std::array<std::uint32_t, 4> captured_{};
  bool running_ = false;
  bool down_ = false;  // DIR
  bool level_ = false;
  std::int64_t edges_ = 0;
  std::uint32_t count_ = 0;  // at origin_; in encoder mode the count
  BoardTime origin_ = 0;
  BoardTime tick_ = 1;           // since origin_
  BoardTime next_wrap_ = never;  // free-running only
};

}  // namespace kmax::virtual_board
