#include "host_tools/virtual_board/stm32f4/one_pulse_timer.hpp"

#include <cstddef>

#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace {
using PulseLayout = drivers::stm32f4::TimerRegisters;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_egr = drivers::stm32f4::timer_egr;
namespace timer_sr = drivers::stm32f4::timer_sr;
constexpr std::uint32_t pulse_settings = timer_cr1::UpdateRequestSource::mask | timer_cr1::OnePulse::mask;
}  // namespace

OnePulseTimerModel::OnePulseTimerModel(const BoardClocks& clocks)
    : RegisterBlock("TIM2", registers()), clocks_(clocks) {}

void OnePulseTimerModel::reset(BoardTime now) {
  cr1_ = ccmr2_ = ccer_ = ccr4_ = sr_ = count_ = 0;
  arr_ = 0xFFFF'FFFF;
  running_ = false;
  show(now);
}

const RegisterTable<OnePulseTimerModel>& OnePulseTimerModel::registers() {
  using Model = OnePulseTimerModel;
  using Row = Register<Model>;
  static const RegisterTable<Model> table{
      {offsetof(PulseLayout, cr1), "CR1", Row::shows<&Model::read_cr1>,
       pulse_settings | timer_cr1::Enable::mask, Row::takes<&Model::write_cr1>},
      Row::reserved(offsetof(PulseLayout, dier), "DIER"),
      {offsetof(PulseLayout, sr), "SR", Row::shows<&Model::sr_>, any_bits, Row::clears_by_zeros<&Model::sr_>},
      {offsetof(PulseLayout, egr), "EGR", Row::zero, timer_egr::Update::mask, Row::takes<&Model::write_egr>},
      {offsetof(PulseLayout, ccmr[1]), "CCMR2", Row::shows<&Model::ccmr2_>, timer_ccmr::CompareMode<4>::mask,
       Row::takes<&Model::write_output>},
      {offsetof(PulseLayout, ccer), "CCER", Row::shows<&Model::ccer_>, timer_ccer::Enable<4>::mask,
       Row::takes<&Model::write_enable>},
      {offsetof(PulseLayout, cnt), "CNT", Row::shows<&Model::read_cnt>},
      Row::reserved(offsetof(PulseLayout, psc), "PSC"),
      {offsetof(PulseLayout, arr), "ARR", Row::shows<&Model::arr_>, any_bits,
       Row::takes<&Model::write_length<&Model::arr_>>},
      {offsetof(PulseLayout, ccr[3]), "CCR4", Row::shows<&Model::ccr4_>, any_bits,
       Row::takes<&Model::write_length<&Model::ccr4_>>}};
  return table;
}

std::uint32_t OnePulseTimerModel::count(BoardTime now) const {
  if (!running_) return count_;
  return count_ + static_cast<std::uint32_t>((now - started_) / clocks_.apb1_timer);
}

/// The pulse begins with the comparison and ends with the counter.
BoardTime OnePulseTimerModel::next_event() const {
  if (!running_) return never;
  const auto at = [this](std::uint32_t value) {
    return started_ + BoardTime{value - count_} * clocks_.apb1_timer;
  };
  return !output_ && timer_ccer::Enable<4>::of(ccer_) != 0 && ccr4_ > count_ && ccr4_ <= arr_
             ? at(ccr4_)
             : at(arr_) + clocks_.apb1_timer;
}

void OnePulseTimerModel::advance(BoardTime now) {
  while (next_event() <= now) {
    const BoardTime event = next_event();
    if (count(event) > arr_) {
      running_ = false;
      count_ = 0;
      sr_ |= timer_sr::Update::mask;
    }
    show(event);
  }
}

void OnePulseTimerModel::show(BoardTime now) {
  const bool driven = timer_ccer::Enable<4>::of(ccer_) != 0 &&
                      timer_ccmr::CompareMode<4>::of(ccmr2_) == timer_ccmr::pwm_mode_2;
  const bool output = driven && count(now) >= ccr4_;
  if (output == output_) return;
  output_ = output;
  if (changed_) changed_(now);
}

std::uint32_t OnePulseTimerModel::read_cr1() const {
  return cr1_ | timer_cr1::Enable::bits(running_ ? 1 : 0);
}

void OnePulseTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  const bool enable = timer_cr1::Enable::of(value) != 0;
  refuse_if(enable && timer_cr1::OnePulse::of(value) == 0, access, "only one pulse (OPM = 1) is modelled");
  cr1_ = value & pulse_settings;
  if (enable == running_) return;
  count_ = count(access.now);
  started_ = access.now;
  running_ = enable;
  show(access.now);
}

void OnePulseTimerModel::write_egr(const Access& access, std::uint32_t value) {
  if (value == 0) return;
  count_ = 0;
  started_ = access.now;
  if (timer_cr1::UpdateRequestSource::of(cr1_) == 0) sr_ |= timer_sr::Update::mask;
  show(access.now);
}

void OnePulseTimerModel::write_output(const Access& access, std::uint32_t value) {
  const std::uint32_t mode = timer_ccmr::CompareMode<4>::of(value);
  refuse_if(mode != 0 && mode != timer_ccmr::pwm_mode_2, access, "OC4M = {} is not modelled; 0 and 7 are",
            mode);
  ccmr2_ = value;
  show(access.now);
}

void OnePulseTimerModel::write_enable(const Access& access, std::uint32_t value) {
  ccer_ = value;
  show(access.now);
}

template <std::uint32_t OnePulseTimerModel::*word>
void OnePulseTimerModel::write_length(const Access& access, std::uint32_t value) {
  refuse_if(running_, access, "ARR or CCR4 is written while it counts");
  refuse_if(value == 0, access, "ARR or CCR4 = 0: the pulse would have no end");
  this->*word = value;
  show(access.now);
}

}  // namespace kmax::virtual_board
