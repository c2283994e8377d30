#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "drivers/stm32f4/registers/timer.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"
#include "host_tools/virtual_board/stm32f4/centre_aligned_counter.hpp"

namespace kmax::virtual_board {

// What all timers' capture/compare channels share: RM0090, registers TIMx_CCMR1, TIMx_CCMR2 and TIMx_CCER.
// Channels by index from 0; the fields are those of channel 1.

/// A register that takes effect with an update event.
struct PreloadedWord {
  std::uint32_t preload = 0;  ///< as written
  std::uint32_t active = 0;
};

/// A channel's part of CCMR1 and CCMR2.
constexpr std::uint32_t channel_mode(const std::array<std::uint32_t, 2>& ccmr, unsigned index) {
  return ccmr[index / 2] >> (drivers::stm32f4::timer_ccmr::bits_per_channel * (index % 2));
}

/// A channel's part of CCER, with those of the channels above it.
constexpr std::uint32_t channel_switches(std::uint32_t ccer, unsigned index) {
  return ccer >> (drivers::stm32f4::timer_ccer::bits_per_channel * index);
}

enum class AdvancedTimer : std::uint8_t { tim1, tim8 };
enum class TimerRequest : std::uint8_t { update, compare_4 };
/// What becomes of the gate signals while a debugger's halt stops the counter. RM0090 does not say. The
/// manuals of the older F1 and the newer F3 do: off, as after a break; and the same timer with its counter
/// stopped otherwise holds the levels that it had.
enum class FrozenOutputs : std::uint8_t { off, held };

/// What the gate signals of one half-bridge do at present, on average over half a PWM period.
struct PwmLegOutput {
  bool enabled = false;  ///< false: both gates off
  double high_duty =
      0.0;  ///< share of the time for which the high side is commanded, 0 to 1, by the active registers
  double dead_time = 0.0;  ///< s, after each change
  friend bool operator==(const PwmLegOutput&, const PwmLegOutput&) = default;
};

/// TIM1 or TIM8 as a motor's PWM generator: RM0090, chapter Advanced-control timers (TIM1&TIM8).
///
/// Modelled: centre-aligned counting; ARR and CCR1 to CCR3 with their preload; update event and UIF; UG; TRGO
/// as UG, CEN or update event; slave trigger mode from ITR0 (TIM8 only, from TIM1); PWM mode 2 on channels 1
/// to 3 with complementary outputs; MOE, OSSI, OSSR, CKD and DTG; the break, BG and BIF; LOCK levels 1 to 3;
/// the DMA requests of the update event and of channel 4, which compares without an output. No delay between
/// the two timers (silicon: a tick or two through ITR0).
///
/// A debugger's halt stops the counter where DBGMCU says so, see freeze().
///
/// Refused, since no driver uses it: counting edge-aligned, PSC, the repetition counter, UDIS, OPM, external
/// clock and trigger, all interrupts and other DMA requests, AOE, PWM mode 1, inputs, an output of channel 4,
/// active-low outputs, idle levels of 1, one output of a pair without the other, writing CNT or CMS or an ARR
/// without preload while counting, a start with the count at the end of its direction. CC4IF is set while
/// CC4DE is, the other compare flags stay 0.
///
/// No pin is mapped to BKIN on this board: it reads as set_break_input() says, and a break that it holds
/// keeps MOE at 0.
///
/// The over- and underflow are events of the board only while somebody can see them: trigger output, a DMA
/// request, a preloaded value that waits. At most two for each PWM period; otherwise they are made up
/// for at the next access. Hence any write may bring next_event() forward.
class AdvancedTimerModel final : public RegisterBlock<AdvancedTimerModel> {
 public:
  AdvancedTimerModel(AdvancedTimer unit, const BoardClocks& clocks);

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  void reset(BoardTime now) override;

  /// Rising edges of TRGO. With MMS = 2 this is the update event.
  void on_trigger_output(std::function<void(BoardTime)> listener) { trigger_output_ = std::move(listener); }
  void on_dma_request(std::function<void(TimerRequest, BoardTime)> listener) {
    dma_request_ = std::move(listener);
  }
  /// Called after outputs() has changed.
  void on_output_change(std::function<void(BoardTime)> listener) { output_change_ = std::move(listener); }

  /// A rising edge on ITR0.
  void trigger_input(BoardTime now);
  /// The clock security system has seen the crystal fail. Without BKE nothing happens.
  void clock_failure_break(BoardTime now);
  /// The level that BKIN reads without a pin; low at first.
  void set_break_input(bool high, BoardTime now);
  /// A debugger halts the core, or lets it go on, with the timer's bit in DBGMCU set. The counter stands
  /// meanwhile, and then goes on; MOE is left alone.
  void freeze(bool frozen, FrozenOutputs outputs, BoardTime now);

  /// Legs A, B, C. The caller must have advanced the timer to the present.
  const std::array<PwmLegOutput, 3>& outputs() const { return outputs_; }
  bool moe() const;
  bool counting_down() const { return counter_.down(); }

 private:
  static const RegisterTable<AdvancedTimerModel>& registers();
  std::uint32_t read_cr1() const;
  void write_cr1(const Access& access, std::uint32_t value);
  void write_cr2(const Access& access, std::uint32_t value);
  void write_smcr(const Access& access, std::uint32_t value);
  void write_egr(const Access& access, std::uint32_t value);
  void write_ccmr(const Access& access, unsigned index, std::uint32_t value);
  void write_ccer(const Access& access, std::uint32_t value);
  std::uint32_t read_cnt(const Access& access) const { return counter_.count(access.now); }
  void write_cnt(const Access& access, std::uint32_t value);
  void write_arr(const Access& access, std::uint32_t value);
  void write_ccr(const Access& access, unsigned index, std::uint32_t value);
  void write_bdtr(const Access& access, std::uint32_t value);
  void write_ccr4(const Access& access, std::uint32_t value);
  void write_dier(const Access& access, std::uint32_t value);
  void write_sr(const Access& access, std::uint32_t value);
  void require_defined_outputs(const Access& access) const;

  bool centre_aligned() const;
  BoardTime tick() const { return clocks_.apb2_timer; }
  void start_counter(BoardTime now);
  void pass_turn();
  void pass_compare();
  void schedule_compare(BoardTime after);
  void request(TimerRequest request, BoardTime now);
  void take_break(BoardTime now);
  bool break_held() const;
  void update_event(BoardTime now, bool flagged, bool changed);
  bool load_preloaded();
  void software_update(BoardTime now);
  void show_trigger_level(BoardTime now);
  void note_waiting();
  void refresh_outputs(BoardTime now);
  PwmLegOutput leg_output(unsigned leg) const;
  std::uint32_t output_mode(unsigned leg) const;
  bool preloaded(unsigned leg) const;

  AdvancedTimer unit_;
  const BoardClocks& clocks_;
  std::function<void(BoardTime)> trigger_output_;
  std::function<void(BoardTime)> output_change_;
  std::function<void(TimerRequest, BoardTime)> dma_request_;

  CentreAlignedCounter counter_;
  std::uint32_t cr1_ = 0;  // without CEN and DIR, which the counter has
  std::uint32_t cr2_ = 0, smcr_ = 0, sr_ = 0, ccer_ = 0, bdtr_ = 0;
  std::array<std::uint32_t, 2> ccmr_{};
  PreloadedWord arr_;
  std::array<PreloadedWord, 3> ccr_{};
  std::uint32_t ccr4_ = 0, dier_ = 0;
  BoardTime compare_at_ = never;  ///< channel 4, before the next turn
  bool break_input_high_ = false;
  bool frozen_ = false, held_by_halt_ = false;
  FrozenOutputs frozen_outputs_ = FrozenOutputs::off;
  bool lock_decided_ = false;
  bool waiting_ = false;  // a preloaded value differs from the active one
  bool trigger_level_ = false;
  std::array<PwmLegOutput, 3> outputs_{};
};

}  // namespace kmax::virtual_board
