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
namespace timer_smcr = drivers::stm32f4::timer_smcr;
namespace timer_sr = drivers::stm32f4::timer_sr;

constexpr unsigned legs = 3;
constexpr std::uint32_t cr1_known = timer_cr1::Enable::mask | timer_cr1::UpdateRequestSource::mask |
                                    timer_cr1::CountingDown::mask | timer_cr1::Alignment::mask |
                                    timer_cr1::AutoReloadPreload::mask | timer_cr1::ClockDivision::mask;
constexpr std::uint32_t cr1_of_counter = timer_cr1::Enable::mask | timer_cr1::CountingDown::mask;
constexpr std::uint32_t smcr_known = timer_smcr::SlaveMode::mask | timer_smcr::TriggerSelection::mask;
constexpr std::uint32_t dier_known = timer_dier::UpdateInterrupt::mask | timer_dier::BreakInterrupt::mask;
constexpr std::uint32_t egr_known = timer_egr::Update::mask | timer_egr::Break::mask;
constexpr std::uint32_t channel_modes =
    timer_ccmr::CompareMode<1>::mask | timer_ccmr::ComparePreload<1>::mask;
constexpr std::uint32_t ccmr_known[2] = {channel_modes | channel_modes << timer_ccmr::bits_per_channel,
                                         channel_modes};
constexpr std::uint32_t pair = timer_ccer::Enable<1>::mask | timer_ccer::ComplementaryEnable<1>::mask;
constexpr std::uint32_t ccer_known =
    pair | pair << timer_ccer::bits_per_channel | pair << 2 * timer_ccer::bits_per_channel;
constexpr std::uint32_t bdtr_known = 0xFFFF;
constexpr std::uint32_t longest_repetition = 0xFF;

/// What a LOCK level takes away from BDTR itself (register TIMx_BDTR, field LOCK); CR2 and CCER have nothing
/// left to protect here, because idle levels and polarities other than 0 are refused anyway.
std::uint32_t locked_bits(std::uint32_t level) {
  std::uint32_t locked = 0;
  if (level >= 1) {
    locked |= timer_bdtr::DeadTime::mask | timer_bdtr::BreakEnable::mask | timer_bdtr::BreakActiveHigh::mask |
              timer_bdtr::AutomaticOutputEnable::mask;
  }
  if (level >= 2) locked |= timer_bdtr::IdleOffState::mask | timer_bdtr::RunOffState::mask;
  return locked;
}

}  // namespace

std::uint32_t AdvancedTimerModel::read(const Access& access) {
  require_word(access, name_);
  advance(access.now);
  switch (access.offset) {
    case offsetof(TimerRegisters, cr1):
      return cr1_ | timer_cr1::Enable::bits(counter_.running() ? 1 : 0) |
             timer_cr1::CountingDown::bits(counter_.down() ? 1 : 0);
    case offsetof(TimerRegisters, cr2):
      return cr2_;
    case offsetof(TimerRegisters, smcr):
      return smcr_;
    case offsetof(TimerRegisters, dier):
      return dier_;
    case offsetof(TimerRegisters, sr):
      return sr_;
    case offsetof(TimerRegisters, egr):
      return 0;
    case offsetof(TimerRegisters, ccmr[0]):
      return ccmr_[0];
    case offsetof(TimerRegisters, ccmr[1]):
      return ccmr_[1];
    case offsetof(TimerRegisters, ccer):
      return ccer_;
    case offsetof(TimerRegisters, cnt):
      return counter_.count(access.now);
    case offsetof(TimerRegisters, psc):
      return psc_.preload;
    case offsetof(TimerRegisters, arr):
      return arr_.preload;
    case offsetof(TimerRegisters, rcr):
      return rcr_;
    case offsetof(TimerRegisters, ccr[0]):
      return ccr_[0].preload;
    case offsetof(TimerRegisters, ccr[1]):
      return ccr_[1].preload;
    case offsetof(TimerRegisters, ccr[2]):
      return ccr_[2].preload;
    case offsetof(TimerRegisters, ccr[3]):
      return 0;
    case offsetof(TimerRegisters, bdtr):
      return bdtr_;
    default:
      refuse(access, name_, "register is not modelled");
  }
}

void AdvancedTimerModel::write(const Access& access, std::uint32_t value) {
  require_word(access, name_);
  advance(access.now);
  switch (access.offset) {
    case offsetof(TimerRegisters, cr1):
      write_cr1(access, value);
      break;
    case offsetof(TimerRegisters, cr2):
      write_cr2(access, value);
      break;
    case offsetof(TimerRegisters, smcr):
      write_smcr(access, value);
      break;
    case offsetof(TimerRegisters, dier):
      require_known(access, value, dier_known, "DIER");
      dier_ = value;
      update_interrupts();
      break;
    case offsetof(TimerRegisters, sr):
      sr_ &= value;
      update_interrupts();
      break;
    case offsetof(TimerRegisters, egr):
      write_egr(access, value);
      break;
    case offsetof(TimerRegisters, ccmr[0]):
      write_ccmr(access, 0, value);
      break;
    case offsetof(TimerRegisters, ccmr[1]):
      write_ccmr(access, 1, value);
      break;
    case offsetof(TimerRegisters, ccer):
      write_ccer(access, value);
      break;
    case offsetof(TimerRegisters, cnt):
      write_cnt(access, value);
      break;
    case offsetof(TimerRegisters, psc):
      require_16_bits(access, value);
      psc_.preload = value;
      note_waiting();
      break;
    case offsetof(TimerRegisters, arr):
      write_arr(access, value);
      break;
    case offsetof(TimerRegisters, rcr):
      require_known(access, value, longest_repetition, "RCR");
      rcr_ = value;
      break;
    case offsetof(TimerRegisters, ccr[0]):
      write_ccr(access, 0, value);
      break;
    case offsetof(TimerRegisters, ccr[1]):
      write_ccr(access, 1, value);
      break;
    case offsetof(TimerRegisters, ccr[2]):
      write_ccr(access, 2, value);
      break;
    case offsetof(TimerRegisters, ccr[3]):
      if (value != 0) refuse(access, name_, "channel 4 is not modelled");
      break;
    case offsetof(TimerRegisters, bdtr):
      write_bdtr(access, value);
      break;
    default:
      refuse(access, name_, "register is not modelled");
  }
}

void AdvancedTimerModel::require_known(const Access& access, std::uint32_t value, std::uint32_t known,
                                       const char* name) const {
  if ((value & ~known) == 0) return;
  refuse(access, name_,
         std::string(name) + " is written " + std::to_string(value) + "; the bits in " +
             std::to_string(value & ~known) + " are not modelled, those in " + std::to_string(known) +
             " are");
}

void AdvancedTimerModel::require_16_bits(const Access& access, std::uint32_t value) const {
  if (value > 0xFFFFU) refuse(access, name_, std::to_string(value) + " does not fit into 16 bits");
}

void AdvancedTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  require_known(access, value, cr1_known, "CR1");
  if (timer_cr1::ClockDivision::of(value) == 3) refuse(access, name_, "CKD = 3 is reserved");
  const std::uint32_t alignment = timer_cr1::Alignment::of(value);
  const bool down = timer_cr1::CountingDown::of(value) != 0;
  const bool enable = timer_cr1::Enable::of(value) != 0;
  const bool realigned = alignment != timer_cr1::Alignment::of(cr1_);
  if (realigned && counter_.running())
    refuse(access, name_, "CMS must not be changed while the counter runs");
  if (realigned && down != counter_.down()) {
    refuse(access, name_,
           "CMS and DIR must not be changed by one write (Hints on using center-aligned mode)");
  }
  // In centre-aligned mode DIR is the hardware's.
  if (!centre_aligned() && alignment == 0) counter_.set_direction(down);
  cr1_ = value & ~cr1_of_counter;

  if (!enable && counter_.running()) {
    counter_.stop(access.now);
    show_trigger_level(access.now);
  } else if (enable && !counter_.running()) {
    if (alignment == 0)
      refuse(access, name_, "only centre-aligned counting is modelled; CEN needs CMS 1, 2 or 3");
    const std::uint32_t count = counter_.count(access.now);
    if (arr_.active == 0 || count > arr_.active || count == (counter_.down() ? 0 : arr_.active)) {
      refuse(access, name_,
             "the counter is started at " + std::to_string(count) +
                 (counter_.down() ? " downwards" : " upwards") +
                 " with ARR = " + std::to_string(arr_.active) + ": it is at or beyond its turn already");
    }
    start_counter(access.now);
  }
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_cr2(const Access& access, std::uint32_t value) {
  require_known(access, value, timer_cr2::MasterMode::mask, "CR2");
  const std::uint32_t master = timer_cr2::MasterMode::of(value);
  if (master > timer_cr2::master_update) {
    refuse(access, name_, "MMS = " + std::to_string(master) + " is not modelled; 0, 1 and 2 are");
  }
  cr2_ = value;
  show_trigger_level(access.now);
}

void AdvancedTimerModel::write_smcr(const Access& access, std::uint32_t value) {
  require_known(access, value, smcr_known, "SMCR");
  const std::uint32_t mode = timer_smcr::SlaveMode::of(value);
  const std::uint32_t trigger = timer_smcr::TriggerSelection::of(value);
  if (mode != timer_smcr::slave_off) {
    if (mode != timer_smcr::slave_trigger) {
      refuse(access, name_, "SMS = " + std::to_string(mode) + " is not modelled; 0 and 6 (trigger) are");
    }
    if (unit_ != AdvancedTimer::tim8 || trigger != timer_smcr::internal_trigger_0) {
      refuse(access, name_, "the only trigger that is modelled is ITR0 of TIM8, which is TIM1");
    }
  }
  if (trigger != timer_smcr::TriggerSelection::of(smcr_) && timer_smcr::SlaveMode::of(smcr_) != 0) {
    refuse(access, name_, "TS must be changed only while SMS = 0");
  }
  smcr_ = value;
}

void AdvancedTimerModel::write_egr(const Access& access, std::uint32_t value) {
  require_known(access, value, egr_known, "EGR");
  if (timer_egr::Break::of(value) != 0) break_event(access.now);
  if (timer_egr::Update::of(value) != 0) software_update(access.now);
}

void AdvancedTimerModel::write_ccmr(const Access& access, unsigned index, std::uint32_t value) {
  require_known(access, value, ccmr_known[index], index == 0 ? "CCMR1" : "CCMR2");
  if (timer_bdtr::Lock::of(bdtr_) == 3) return;
  for (unsigned shift = 0; shift <= timer_ccmr::bits_per_channel; shift += timer_ccmr::bits_per_channel) {
    const std::uint32_t mode = timer_ccmr::CompareMode<1>::of(value >> shift);
    if (mode != 0 && mode != timer_ccmr::pwm_mode_1 && mode != timer_ccmr::pwm_mode_2) {
      refuse(access, name_, "OCxM = " + std::to_string(mode) + " is not modelled; 0, 6 and 7 are");
    }
  }
  ccmr_[index] = value;
  for (unsigned leg = 0; leg < legs; ++leg) {
    if (!preloaded(leg)) ccr_[leg].active = ccr_[leg].preload;
  }
  note_waiting();
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_ccer(const Access& access, std::uint32_t value) {
  require_known(access, value, ccer_known, "CCER");
  for (unsigned leg = 0; leg < legs; ++leg) {
    const std::uint32_t enabled = value >> (timer_ccer::bits_per_channel * leg) & pair;
    if (enabled != 0 && enabled != pair) {
      refuse(access, name_,
             "CCxE and CCxNE of channel " + std::to_string(leg + 1) + " differ: a leg with one gate only");
    }
  }
  ccer_ = value;
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_cnt(const Access& access, std::uint32_t value) {
  require_16_bits(access, value);
  if (counter_.running()) refuse(access, name_, "CNT must not be written while counting centre-aligned");
  counter_.set_count(value);
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_arr(const Access& access, std::uint32_t value) {
  require_16_bits(access, value);
  if (timer_cr1::AutoReloadPreload::of(cr1_) == 0) {
    if (counter_.running()) refuse(access, name_, "ARR is written without preload (ARPE = 0) while counting");
    arr_.active = value;
  } else if (value == 0) {
    refuse(access, name_, "ARR = 0 stops the counter; 1 to 65535 are allowed");
  }
  arr_.preload = value;
  note_waiting();
}

void AdvancedTimerModel::write_ccr(const Access& access, unsigned index, std::uint32_t value) {
  require_16_bits(access, value);
  ccr_[index].preload = value;
  if (preloaded(index)) {
    note_waiting();
    return;
  }
  ccr_[index].active = value;
  refresh_outputs(access.now);
}

void AdvancedTimerModel::write_bdtr(const Access& access, std::uint32_t value) {
  require_known(access, value, bdtr_known, "BDTR");
  std::uint32_t locked = locked_bits(timer_bdtr::Lock::of(bdtr_));
  if (lock_decided_) locked |= timer_bdtr::Lock::mask;
  const std::uint32_t next = (bdtr_ & locked) | (value & ~locked);
  if (timer_bdtr::BreakEnable::of(next) != 0 && timer_bdtr::BreakActiveHigh::of(next) == 0) {
    refuse(access, name_,
           "BKE = 1 with BKP = 0: no pin is mapped to BKIN, it reads low and would break for ever");
  }
  lock_decided_ = true;
  bdtr_ = next;
  require_defined_outputs(access);
  refresh_outputs(access.now);
}

/// An enabled output needs a PWM mode.
void AdvancedTimerModel::require_defined_outputs(const Access& access) const {
  if (!moe()) return;
  for (unsigned leg = 0; leg < legs; ++leg) {
    const bool enabled = (ccer_ >> (timer_ccer::bits_per_channel * leg) & pair) != 0;
    if (enabled && channel_mode(leg) == 0) {
      refuse(access, name_,
             "channel " + std::to_string(leg + 1) + " drives its outputs without a PWM mode (OCxM = 0)");
    }
  }
}

}  // namespace kmax::virtual_board
