// The registers of AdvancedTimerModel as the bus sees them: what is accepted, what is refused, what LOCK
// protects.

#include <cstddef>
#include <string>

#include "drivers/stm32f4/registers/timer.hpp"
#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::TimerRegisters;
namespace timer_bdtr = drivers::stm32f4::timer_bdtr;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_cr2 = drivers::stm32f4::timer_cr2;
namespace timer_dier = drivers::stm32f4::timer_dier;
namespace timer_egr = drivers::stm32f4::timer_egr;
namespace timer_sr = drivers::stm32f4::timer_sr;
namespace timer_smcr = drivers::stm32f4::timer_smcr;

constexpr std::uint32_t cr1_writable = timer_cr1::Enable::mask | timer_cr1::UpdateRequestSource::mask |
                                       timer_cr1::CountingDown::mask | timer_cr1::Alignment::mask |
                                       timer_cr1::AutoReloadPreload::mask | timer_cr1::ClockDivision::mask;
constexpr std::uint32_t cr1_of_counter = timer_cr1::Enable::mask | timer_cr1::CountingDown::mask;
constexpr std::uint32_t smcr_writable = timer_smcr::SlaveMode::mask | timer_smcr::TriggerSelection::mask;
constexpr std::uint32_t channel_modes =
    timer_ccmr::CompareMode<1>::mask | timer_ccmr::ComparePreload<1>::mask;
constexpr std::uint32_t ccmr_writable[2] = {channel_modes | channel_modes << timer_ccmr::bits_per_channel,
                                            channel_modes};
constexpr std::uint32_t pair = timer_ccer::Enable<1>::mask | timer_ccer::ComplementaryEnable<1>::mask;
constexpr std::uint32_t ccer_writable =
    pair | pair << timer_ccer::bits_per_channel | pair << 2 * timer_ccer::bits_per_channel;
constexpr std::uint32_t half_word = 0xFFFF;

/// What a LOCK level takes away from BDTR itself (register TIMx_BDTR, field LOCK); CR2 and CCER have nothing
/// left to protect here, because idle levels and polarities other than 0 are refused anyway.
std::uint32_t locked_bits(std::uint32_t level) {
  std::uint32_t locked = 0;
  if (level >= 1) {
    locked |= timer_bdtr::DeadTime::mask | timer_bdtr::BreakEnable::mask | timer_bdtr::BreakActiveHigh::mask;
  }
  if (level >= 2) locked |= timer_bdtr::IdleOffState::mask | timer_bdtr::RunOffState::mask;
  return locked;
}

}  // namespace

const RegisterTable<AdvancedTimerModel>& AdvancedTimerModel::registers() {
  using Model = AdvancedTimerModel;
  using Row = Register<Model>;
  using Layout = TimerRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cr1), "CR1", Row::shows<&Model::read_cr1>, cr1_writable,
       Row::takes<&Model::write_cr1>},
      {offsetof(Layout, cr2), "CR2", Row::shows<&Model::cr2_>, timer_cr2::MasterMode::mask,
       Row::takes<&Model::write_cr2>},
      {offsetof(Layout, smcr), "SMCR", Row::shows<&Model::smcr_>, smcr_writable,
       Row::takes<&Model::write_smcr>},
      {offsetof(Layout, dier), "DIER", Row::shows<&Model::dier_>,
       timer_dier::UpdateDma::mask | timer_dier::CaptureCompareDma<4>::mask, Row::takes<&Model::write_dier>},
      {offsetof(Layout, sr), "SR", Row::shows<&Model::sr_>, any_bits, Row::takes<&Model::write_sr>},
      {offsetof(Layout, egr), "EGR", Row::zero,
       timer_egr::Update::mask | timer_egr::CaptureCompare<4>::mask | timer_egr::Break::mask,
       Row::takes<&Model::write_egr>},
      {offsetof(Layout, ccmr[0]), "CCMR1", Row::shows<&Model::ccmr_, 0>, ccmr_writable[0],
       Row::takes<&Model::write_ccmr, 0>},
      {offsetof(Layout, ccmr[1]), "CCMR2", Row::shows<&Model::ccmr_, 1>, ccmr_writable[1],
       Row::takes<&Model::write_ccmr, 1>},
      {offsetof(Layout, ccer), "CCER", Row::shows<&Model::ccer_>, ccer_writable,
       Row::takes<&Model::write_ccer>},
      {offsetof(Layout, cnt), "CNT", Row::shows<&Model::read_cnt>, half_word, Row::takes<&Model::write_cnt>},
      Row::reserved(offsetof(Layout, psc), "PSC"),
      {offsetof(Layout, arr), "ARR", Row::shows<&Model::arr_, &PreloadedWord::preload>, half_word,
       Row::takes<&Model::write_arr>},
      Row::reserved(offsetof(Layout, rcr), "RCR"),
      {offsetof(Layout, ccr[0]), "CCR1", Row::shows<&Model::ccr_, 0, &PreloadedWord::preload>, half_word,
       Row::takes<&Model::write_ccr, 0>},
      {offsetof(Layout, ccr[1]), "CCR2", Row::shows<&Model::ccr_, 1, &PreloadedWord::preload>, half_word,
       Row::takes<&Model::write_ccr, 1>},
      {offsetof(Layout, ccr[2]), "CCR3", Row::shows<&Model::ccr_, 2, &PreloadedWord::preload>, half_word,
       Row::takes<&Model::write_ccr, 2>},
      {offsetof(Layout, ccr[3]), "CCR4", Row::shows<&Model::ccr4_>, half_word,
       Row::takes<&Model::write_ccr4>},
      {offsetof(Layout, bdtr), "BDTR", Row::shows<&Model::bdtr_>,
       half_word & ~timer_bdtr::AutomaticOutputEnable::mask, Row::takes<&Model::write_bdtr>}};
  return table;
}

std::uint32_t AdvancedTimerModel::read_cr1() const {
  return cr1_ | timer_cr1::Enable::bits(counter_.running() ? 1 : 0) |
         timer_cr1::CountingDown::bits(counter_.down() ? 1 : 0);
}

void AdvancedTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  if (timer_cr1::ClockDivision::of(value) == 3) refuse(access, "CKD = 3 is reserved");
  const std::uint32_t alignment = timer_cr1::Alignment::of(value);
  const bool down = timer_cr1::CountingDown::of(value) != 0;
  const bool enable = timer_cr1::Enable::of(value) != 0;
  const bool realigned = alignment != timer_cr1::Alignment::of(cr1_);
  if (realigned && counter_.running()) refuse(access, "CMS must not be changed while the counter runs");
  if (realigned && down != counter_.down()) {
    refuse(access, "CMS and DIR must not be changed by one write (Hints on using center-aligned mode)");
  }
  // In centre-aligned mode DIR is the hardware's.
  if (!centre_aligned() && alignment == 0) counter_.set_direction(down);
  cr1_ = value & ~cr1_of_counter;

  if (!enable && counter_.running()) {
    counter_.stop(access.now);
    compare_at_ = never;
    show_trigger_level(access.now);
  } else if (enable && !counter_.running()) {
    if (alignment == 0) refuse(access, "only centre-aligned counting is modelled; CEN needs CMS 1, 2 or 3");
    const std::uint32_t count = counter_.count(access.now);
    if (arr_.active == 0 || count > arr_.active || count == (counter_.down() ? 0 : arr_.active)) {
      refuse(access, "the counter is started at " + std::to_string(count) +
                         (counter_.down() ? " downwards" : " upwards") + " with ARR = " +
                         std::to_string(arr_.active) + ": it is at or beyond its turn already");
    }
    start_counter(access.now);
  }
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_cr2(const Access& access, std::uint32_t value) {
  const std::uint32_t master = timer_cr2::MasterMode::of(value);
  if (master > timer_cr2::master_update) {
    refuse(access, "MMS = " + std::to_string(master) + " is not modelled; 0, 1 and 2 are");
  }
  cr2_ = value;
  show_trigger_level(access.now);
}

void AdvancedTimerModel::write_smcr(const Access& access, std::uint32_t value) {
  const std::uint32_t mode = timer_smcr::SlaveMode::of(value);
  const std::uint32_t trigger = timer_smcr::TriggerSelection::of(value);
  if (mode != timer_smcr::slave_off) {
    if (mode != timer_smcr::slave_trigger) {
      refuse(access, "SMS = " + std::to_string(mode) + " is not modelled; 0 and 6 (trigger) are");
    }
    if (unit_ != AdvancedTimer::tim8 || trigger != timer_smcr::internal_trigger_0) {
      refuse(access, "the only trigger that is modelled is ITR0 of TIM8, which is TIM1");
    }
  }
  if (trigger != timer_smcr::TriggerSelection::of(smcr_) && timer_smcr::SlaveMode::of(smcr_) != 0) {
    refuse(access, "TS must be changed only while SMS = 0");
  }
  smcr_ = value;
}

void AdvancedTimerModel::write_egr(const Access& access, std::uint32_t value) {
  if (timer_egr::Update::of(value) != 0) software_update(access.now);
  if (timer_egr::Break::of(value) != 0) take_break(access.now);
  if (timer_egr::CaptureCompare<4>::of(value) == 0) return;
  sr_ |= timer_sr::CaptureCompare<4>::mask;
  request(TimerRequest::compare_4, access.now);
}

void AdvancedTimerModel::write_dier(const Access& access, std::uint32_t value) {
  dier_ = value;
  schedule_compare(access.now);
}

void AdvancedTimerModel::write_sr(const Access& /*access*/, std::uint32_t value) {
  sr_ &= value;
  if (break_held()) sr_ |= timer_sr::Break::mask;
}

/// Without preload; at the turns themselves it is not modelled.
void AdvancedTimerModel::write_ccr4(const Access& access, std::uint32_t value) {
  if (timer_dier::CaptureCompareDma<4>::of(dier_) != 0 && (value == 0 || value == arr_.active))
    refuse(access, "CCR4 at a turn of the counter: no comparison there is modelled");
  ccr4_ = value;
  schedule_compare(access.now);
}

void AdvancedTimerModel::write_ccmr(const Access& access, unsigned index, std::uint32_t value) {
  if (timer_bdtr::Lock::of(bdtr_) == 3) return;
  for (unsigned shift = 0; shift <= timer_ccmr::bits_per_channel; shift += timer_ccmr::bits_per_channel) {
    const std::uint32_t mode = timer_ccmr::CompareMode<1>::of(value >> shift);
    if (mode != 0 && mode != timer_ccmr::pwm_mode_2) {
      refuse(access, "OCxM = " + std::to_string(mode) + " is not modelled; 0 and 7 are");
    }
  }
  ccmr_[index] = value;
  for (unsigned leg = 0; leg < ccr_.size(); ++leg) {
    if (!preloaded(leg)) ccr_[leg].active = ccr_[leg].preload;
  }
  note_waiting();
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_ccer(const Access& access, std::uint32_t value) {
  for (unsigned leg = 0; leg < ccr_.size(); ++leg) {
    const std::uint32_t enabled = channel_switches(value, leg) & pair;
    if (enabled != 0 && enabled != pair) {
      refuse(access,
             "CCxE and CCxNE of channel " + std::to_string(leg + 1) + " differ: a leg with one gate only");
    }
  }
  ccer_ = value;
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_cnt(const Access& access, std::uint32_t value) {
  if (counter_.running()) refuse(access, "CNT must not be written while counting centre-aligned");
  counter_.set_count(value);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_arr(const Access& access, std::uint32_t value) {
  if (timer_cr1::AutoReloadPreload::of(cr1_) == 0) {
    if (counter_.running()) refuse(access, "ARR is written without preload (ARPE = 0) while counting");
    arr_.active = value;
  } else if (value == 0) {
    refuse(access, "ARR = 0 stops the counter; 1 to 65535 are allowed");
  }
  arr_.preload = value;
  note_waiting();
}

void AdvancedTimerModel::write_ccr(const Access& access, unsigned index, std::uint32_t value) {
  ccr_[index].preload = value;
  if (preloaded(index)) {
    note_waiting();
    return;
  }
  ccr_[index].active = value;
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_bdtr(const Access& access, std::uint32_t value) {
  std::uint32_t locked = locked_bits(timer_bdtr::Lock::of(bdtr_));
  if (lock_decided_) locked |= timer_bdtr::Lock::mask;
  const std::uint32_t next = (bdtr_ & locked) | (value & ~locked);
  lock_decided_ = true;
  bdtr_ = next;
  if (break_held()) take_break(access.now);
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

/// An enabled output needs a PWM mode.
void AdvancedTimerModel::require_defined_outputs(const Access& access) const {
  if (!moe()) return;
  for (unsigned leg = 0; leg < ccr_.size(); ++leg) {
    const bool enabled = (channel_switches(ccer_, leg) & pair) != 0;
    if (enabled && output_mode(leg) == 0) {
      refuse(access,
             "channel " + std::to_string(leg + 1) + " drives its outputs without a PWM mode (OCxM = 0)");
    }
  }
}

}  // namespace kmax::virtual_board
