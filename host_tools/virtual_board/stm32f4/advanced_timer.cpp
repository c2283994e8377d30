#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"

#include <algorithm>

#include "drivers/stm32f4/dead_time.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace {

namespace timer_bdtr = drivers::stm32f4::timer_bdtr;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_cr2 = drivers::stm32f4::timer_cr2;
namespace timer_dier = drivers::stm32f4::timer_dier;
namespace timer_smcr = drivers::stm32f4::timer_smcr;
namespace timer_sr = drivers::stm32f4::timer_sr;

constexpr std::uint32_t longest_count = 0xFFFF;

}  // namespace

AdvancedTimerModel::AdvancedTimerModel(AdvancedTimer unit, const BoardClocks& clocks)
    : RegisterBlock(unit == AdvancedTimer::tim1 ? "TIM1" : "TIM8", registers()),
      unit_(unit),
      clocks_(clocks) {
  reset(0);
}

void AdvancedTimerModel::reset(BoardTime now) {
  counter_ = {};
  cr1_ = cr2_ = smcr_ = sr_ = ccer_ = bdtr_ = 0;
  ccmr_ = {};
  arr_ = {longest_count, longest_count};
  ccr_ = {};
  ccr4_ = dier_ = 0;
  compare_at_ = never;
  frozen_ = held_by_halt_ = false;
  lock_decided_ = waiting_ = trigger_level_ = false;
  refresh_outputs(now);
}

void AdvancedTimerModel::advance(BoardTime now) {
  while (std::min(compare_at_, counter_.next_turn()) <= now) {
    if (compare_at_ < counter_.next_turn()) {
      pass_compare();
      continue;
    }
    pass_turn();
    // Nothing tells one period from the next where nobody sees the turns.
    if (next_event() == never) counter_.skip_whole_periods(now);
  }
  if (counter_.tick() == tick()) return;
  counter_.change_tick(now, tick());
  schedule_compare(now);
}

BoardTime AdvancedTimerModel::next_event() const {
  const bool triggers = timer_cr2::MasterMode::of(cr2_) == timer_cr2::master_update && trigger_output_;
  const bool requests = timer_dier::UpdateDma::of(dier_) != 0;
  const bool compares = timer_dier::CaptureCompareDma<4>::of(dier_) != 0;
  // A comparison ahead is found again at each turn.
  return triggers || waiting_ || requests || compares ? std::min(compare_at_, counter_.next_turn()) : never;
}

bool AdvancedTimerModel::moe() const {
  return timer_bdtr::MainOutputEnable::of(bdtr_) != 0;
}

bool AdvancedTimerModel::centre_aligned() const {
  return timer_cr1::Alignment::of(cr1_) != 0;
}

void AdvancedTimerModel::start_counter(BoardTime now) {
  counter_.start(now, tick(), arr_.active);
  schedule_compare(now);
  show_trigger_level(now);
  refresh_outputs(now);
}

/// Over- or underflow.
void AdvancedTimerModel::pass_turn() {
  const BoardTime now = counter_.next_turn();
  const bool changed = load_preloaded();
  counter_.turn(tick(), arr_.active);
  schedule_compare(now);
  update_event(now, true, changed);
}

void AdvancedTimerModel::pass_compare() {
  const BoardTime now = compare_at_;
  compare_at_ = never;
  sr_ |= timer_sr::CaptureCompare<4>::mask;
  request(TimerRequest::compare_4, now);
}

/// Section Center-aligned mode: the flag is set counting down with CMS 1, up with 2, both ways with 3.
void AdvancedTimerModel::schedule_compare(BoardTime after) {
  compare_at_ = never;
  const std::uint32_t direction = counter_.down() ? 1 : 2;
  if (!counter_.running() || timer_dier::CaptureCompareDma<4>::of(dier_) == 0 || ccr4_ == 0 ||
      ccr4_ >= arr_.active || (timer_cr1::Alignment::of(cr1_) & direction) == 0)
    return;
  if (counter_.time_of(ccr4_) > after) compare_at_ = counter_.time_of(ccr4_);
}

void AdvancedTimerModel::request(TimerRequest request, BoardTime now) {
  const bool enabled = request == TimerRequest::update ? timer_dier::UpdateDma::of(dier_) != 0
                                                       : timer_dier::CaptureCompareDma<4>::of(dier_) != 0;
  if (enabled && dma_request_) dma_request_(request, now);
}

/// What follows from an update event once the registers are loaded.
void AdvancedTimerModel::update_event(BoardTime now, bool flagged, bool changed) {
  if (flagged) {
    sr_ |= timer_sr::Update::mask;
    request(TimerRequest::update, now);
  }
  if (changed) refresh_outputs(now);
  if (timer_cr2::MasterMode::of(cr2_) == timer_cr2::master_update && trigger_output_) trigger_output_(now);
}

/// True when a register that shapes the outputs has changed.
bool AdvancedTimerModel::load_preloaded() {
  if (!waiting_) return false;
  arr_.active = arr_.preload;
  for (PreloadedWord& compare : ccr_) compare.active = compare.preload;
  waiting_ = false;
  return true;
}

/// UG: registers TIMx_EGR and TIMx_CR1 (URS), section Counter modes.
void AdvancedTimerModel::software_update(BoardTime now) {
  load_preloaded();
  if (!centre_aligned() && counter_.down()) {
    counter_.set_count(arr_.active);
  } else {
    counter_.restart(now, tick(), arr_.active);
    schedule_compare(now);
  }
  update_event(now, timer_cr1::UpdateRequestSource::of(cr1_) == 0, true);
  if (timer_cr2::MasterMode::of(cr2_) == timer_cr2::master_reset && trigger_output_) trigger_output_(now);
}

void AdvancedTimerModel::trigger_input(BoardTime now) {
  advance(now);
  if (timer_smcr::SlaveMode::of(smcr_) != timer_smcr::slave_trigger) return;
  sr_ |= timer_sr::Trigger::mask;
  if (!counter_.running()) start_counter(now);
}

void AdvancedTimerModel::clock_failure_break(BoardTime now) {
  advance(now);
  if (timer_bdtr::BreakEnable::of(bdtr_) != 0) take_break(now);
}

void AdvancedTimerModel::take_break(BoardTime now) {
  bdtr_ &= ~timer_bdtr::MainOutputEnable::mask;
  sr_ |= timer_sr::Break::mask;
  refresh_outputs(now);
}

bool AdvancedTimerModel::break_held() const {
  return timer_bdtr::BreakEnable::of(bdtr_) != 0 &&
         (timer_bdtr::BreakActiveHigh::of(bdtr_) != 0) == break_input_high_;
}

void AdvancedTimerModel::set_break_input(bool high, BoardTime now) {
  advance(now);
  break_input_high_ = high;
  if (break_held()) take_break(now);
}

void AdvancedTimerModel::freeze(bool frozen, FrozenOutputs outputs, BoardTime now) {
  advance(now);
  if (frozen == frozen_) return;
  frozen_ = frozen;
  frozen_outputs_ = outputs;
  if (frozen) {
    held_by_halt_ = counter_.running();
    counter_.stop(now);
    compare_at_ = never;
  } else if (held_by_halt_) {
    counter_.start(now, tick(), arr_.active);
    schedule_compare(now);
  }
  refresh_outputs(now);
}

/// TRGO is a level with MMS = 1 only; its rising edge counts.
void AdvancedTimerModel::show_trigger_level(BoardTime now) {
  const bool level = timer_cr2::MasterMode::of(cr2_) == timer_cr2::master_enable && counter_.running();
  const bool rises = level && !trigger_level_;
  trigger_level_ = level;
  if (rises && trigger_output_) trigger_output_(now);
}

void AdvancedTimerModel::note_waiting() {
  waiting_ = arr_.preload != arr_.active;
  for (const PreloadedWord& compare : ccr_) waiting_ = waiting_ || compare.preload != compare.active;
}

std::uint32_t AdvancedTimerModel::output_mode(unsigned leg) const {
  return timer_ccmr::CompareMode<1>::of(channel_mode(ccmr_, leg));
}

bool AdvancedTimerModel::preloaded(unsigned leg) const {
  return timer_ccmr::ComparePreload<1>::of(channel_mode(ccmr_, leg)) != 0;
}

/// Section PWM mode: mode 2 is active while counting up for CNT >= CCR, down for CNT > CCR, which is top -
/// CCR ticks of either half period. Stopped, the comparison stands still.
PwmLegOutput AdvancedTimerModel::leg_output(unsigned leg) const {
  const std::uint32_t both = timer_ccer::Enable<1>::mask | timer_ccer::ComplementaryEnable<1>::mask;
  const bool off = !moe() || (frozen_ && frozen_outputs_ == FrozenOutputs::off);
  if (off || (channel_switches(ccer_, leg) & both) == 0) return {};
  const std::uint32_t compare = ccr_[leg].active;
  double above = 0.0;
  if (counter_.running()) {
    const std::uint32_t top = arr_.active;
    above = compare < top ? static_cast<double>(top - compare) / static_cast<double>(top) : 0.0;
  } else {
    const std::uint32_t count = counter_.count(0);
    above = (counter_.down() ? count > compare : count >= compare) ? 1.0 : 0.0;
  }
  const BoardTime dead_time_clock = clocks_.apb2_timer << timer_cr1::ClockDivision::of(cr1_);
  const auto code = static_cast<std::uint8_t>(timer_bdtr::DeadTime::of(bdtr_));
  return {.enabled = true,
          .high_duty = above,
          .dead_time = seconds(dead_time_clock * drivers::stm32f4::dead_time_ticks(code))};
}

void AdvancedTimerModel::refresh_outputs(BoardTime now) {
  bool changed = false;
  for (unsigned leg = 0; leg < outputs_.size(); ++leg) {
    const PwmLegOutput output = leg_output(leg);
    changed = changed || output != outputs_[leg];
    outputs_[leg] = output;
  }
  if (changed && output_change_) output_change_(now);
}

}  // namespace kmax::virtual_board
