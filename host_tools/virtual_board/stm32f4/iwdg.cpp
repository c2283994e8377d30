#include "host_tools/virtual_board/stm32f4/iwdg.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
constexpr std::uint64_t update_cycles = 5;
}  // namespace

void IwdgModel::set_oscillator_hz(std::uint32_t hz) {
  if (hz < stm32::lsi_minimum_hz || hz > stm32::lsi_maximum_hz)
    throw std::invalid_argument("LSI of " + std::to_string(hz) + " Hz; must be 17000 to 47000");
  if (running_) throw std::logic_error("the LSI's frequency cannot be changed while the watchdog runs");
  oscillator_hz_ = hz;
}

BoardTime IwdgModel::cycles(std::uint64_t count) const {
  return (count * units_per_second + oscillator_hz_ - 1) / oscillator_hz_;
}

std::uint64_t IwdgModel::elapsed_cycles(BoardTime now) const {
  return (now - counted_from_) * oscillator_hz_ / units_per_second;
}

void IwdgModel::freeze(bool frozen, BoardTime now) {
  if (frozen == (frozen_at_ != never)) return;
  if (frozen) {
    advance(now);
    frozen_at_ = now;
    return;
  }
  const BoardTime stood = now - std::exchange(frozen_at_, never);
  counted_from_ += stood;
  for (BoardTime* effective : {&pr_effective_, &rlr_effective_})
    if (*effective != never) *effective += stood;
}

BoardTime IwdgModel::fires_at() const {
  if (!running_ || fired_ || frozen_at_ != never) return never;
  return counted_from_ + until_reset_;
}

BoardTime IwdgModel::next_event() const {
  if (!running_ || fired_ || frozen_at_ != never) return never;
  return std::min({fires_at(), pr_effective_, rlr_effective_});
}

void IwdgModel::take_prescaler_over(BoardTime now) {
  const std::uint64_t counted = elapsed_cycles(now) / stm32::iwdg_pr::divider(active_pr_);
  active_pr_ = pr_;
  count_from(now, remaining_ - std::min(counted, remaining_ - 1));
}

void IwdgModel::count_from(BoardTime now, std::uint64_t remaining) {
  counted_from_ = now;
  remaining_ = remaining;
  until_reset_ = cycles(remaining * stm32::iwdg_pr::divider(active_pr_));
}

void IwdgModel::advance(BoardTime now) {
  while (next_event() <= now) {
    const BoardTime event = next_event();
    if (event == fires_at()) {
      fired_ = true;
      if (on_reset_) on_reset_(event);
      return;
    }
    if (event == pr_effective_) {
      pr_effective_ = never;
      take_prescaler_over(event);
    } else {
      rlr_effective_ = never;
      active_rlr_ = rlr_;
    }
  }
}

const RegisterTable<IwdgModel>& IwdgModel::registers() {
  using Model = IwdgModel;
  using Row = Register<Model>;
  using Layout = stm32::IwdgRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, kr), "KR", nullptr, any_bits, Row::takes<&Model::write_key>},
      {offsetof(Layout, pr), "PR", Row::shows<&Model::pr_>, stm32::iwdg_pr::Prescaler::maximum,
       Row::takes<&Model::write_setting<&Model::pr_, &Model::pr_effective_>>},
      {offsetof(Layout, rlr), "RLR", Row::shows<&Model::rlr_>, stm32::iwdg_rlr::Reload::maximum,
       Row::takes<&Model::write_setting<&Model::rlr_, &Model::rlr_effective_>>},
      {offsetof(Layout, sr), "SR", Row::shows<&Model::read_status>}};
  return table;
}

std::uint32_t IwdgModel::read_status() const {
  return stm32::iwdg_sr::PrescalerUpdating::bits(pr_effective_ != never ? 1 : 0) |
         stm32::iwdg_sr::ReloadUpdating::bits(rlr_effective_ != never ? 1 : 0);
}

void IwdgModel::write_key(const Access& access, std::uint32_t key) {
  refuse_if(key != stm32::iwdg_kr::start && key != stm32::iwdg_kr::reload && key != stm32::iwdg_kr::unlock,
            access, "KR: key {} means nothing", key);
  unlocked_ = key == stm32::iwdg_kr::unlock;
  const bool starts = key == stm32::iwdg_kr::start && !running_;
  if (starts) {
    running_ = true;
    if (pr_effective_ != never) pr_effective_ = access.now + cycles(update_cycles);
    if (rlr_effective_ != never) rlr_effective_ = access.now + cycles(update_cycles);
  }
  if (starts || key == stm32::iwdg_kr::reload) {
    count_from(access.now, std::uint64_t{active_rlr_} + 1);
  }
  if (starts && on_started_) on_started_(access.now);
}

template <std::uint32_t IwdgModel::*setting, BoardTime IwdgModel::*effective>
void IwdgModel::write_setting(const Access& access, std::uint32_t value) {
  refuse_if(!unlocked_, access, "PR and RLR need the unlock key 0x5555 first");
  refuse_if(this->*effective != never, access, "written again while PVU or RVU is set");
  this->*setting = value;
  this->*effective = running_ ? access.now + cycles(update_cycles) : 0;
}

void IwdgModel::reset(BoardTime) {
  running_ = fired_ = unlocked_ = false;
  pr_ = active_pr_ = 0;
  rlr_ = active_rlr_ = stm32::iwdg_rlr::Reload::maximum;
  pr_effective_ = rlr_effective_ = frozen_at_ = never;
}

}  // namespace kmax::virtual_board
