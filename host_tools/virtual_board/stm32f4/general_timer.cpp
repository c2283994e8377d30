#include "host_tools/virtual_board/stm32f4/general_timer.hpp"

#include <stdexcept>
#include <string>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::Interrupt;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_dier = drivers::stm32f4::timer_dier;
namespace timer_smcr = drivers::stm32f4::timer_smcr;
namespace timer_sr = drivers::stm32f4::timer_sr;

struct Unit {
  const char* name;
  Interrupt interrupt;
  std::uint32_t longest;
};
constexpr std::array<Unit, 4> units{
    Unit{"TIM2", Interrupt::tim2, 0xFFFF'FFFF}, Unit{"TIM3", Interrupt::tim3, 0xFFFF},
    Unit{"TIM4", Interrupt::tim4, 0xFFFF}, Unit{"TIM5", Interrupt::tim5, 0xFFFF'FFFF}};

}  // namespace

GeneralTimerModel::GeneralTimerModel(GeneralTimer unit, const BoardClocks& clocks, InterruptLines& interrupts)
    : name_(units.at(static_cast<std::size_t>(unit)).name),
      interrupt_(units.at(static_cast<std::size_t>(unit)).interrupt),
      longest_(units.at(static_cast<std::size_t>(unit)).longest),
      clocks_(clocks),
      interrupts_(interrupts) {
  reset(0);
}

void GeneralTimerModel::reset(BoardTime now) {
  cr1_ = smcr_ = dier_ = sr_ = ccer_ = 0;
  ccmr_ = {};
  captured_ = {};
  psc_ = {};
  arr_ = {longest_, longest_};
  running_ = down_ = false;
  count_ = 0;
  origin_ = now;
  next_wrap_ = never;
  update_interrupt();
}

bool GeneralTimerModel::encoder_mode() const {
  return timer_smcr::SlaveMode::of(smcr_) == timer_smcr::slave_encoder_both_inputs;
}

/// Each input that is inverted turns the direction round: table Counting direction versus encoder signals.
bool GeneralTimerModel::reversed() const {
  return timer_ccer::Polarity<1>::of(ccer_) != timer_ccer::Polarity<2>::of(ccer_);
}

std::uint32_t GeneralTimerModel::count(BoardTime now) const {
  if (!running_ || encoder_mode()) return count_;
  return count_ + static_cast<std::uint32_t>((now - origin_) / tick_);
}

/// A count beyond ARR runs on to the counter's own end; the firmware has no use for it and it would take a
/// wrap without an update event, so the registers refuse it.
void GeneralTimerModel::count_from(BoardTime now, std::uint32_t count) {
  count_ = count;
  origin_ = now;
  tick_ = tick();
  next_wrap_ = running_ && !encoder_mode() ? now + tick_ * (BoardTime{arr_.active} - count + 1) : never;
}

void GeneralTimerModel::start(BoardTime now) {
  running_ = true;
  count_from(now, count_);
}

void GeneralTimerModel::stop(BoardTime now) {
  const std::uint32_t stopped_at = count(now);
  running_ = false;
  count_from(now, stopped_at);
}

void GeneralTimerModel::load_preloaded() {
  psc_.active = psc_.preload;
  arr_.active = arr_.preload;
}

void GeneralTimerModel::advance(BoardTime now) {
  if (next_wrap_ <= now) {
    load_preloaded();
    count_from(next_wrap_, 0);
    // Further wraps change nothing any more, so they are passed at once.
    if (next_wrap_ <= now) {
      const BoardTime period = next_wrap_ - origin_;
      count_from(now - (now - origin_) % period, 0);
    }
    flag_update();
  }
  if (running_ && tick_ != tick()) count_from(now, count(now));
}

BoardTime GeneralTimerModel::next_event() const {
  const bool interrupts = timer_dier::UpdateInterrupt::of(dier_) != 0 && timer_sr::Update::of(sr_) == 0;
  return interrupts ? next_wrap_ : never;
}

void GeneralTimerModel::clock_changed(BoardTime now) {
  advance(now);
}

/// UG: register TIMx_EGR. It loads ARR instead of 0 when the direction is down, as it may be in encoder mode.
void GeneralTimerModel::software_update(BoardTime now) {
  load_preloaded();
  count_from(now, down_ ? arr_.active : 0);
  if (timer_cr1::UpdateRequestSource::of(cr1_) == 0) flag_update();
}

void GeneralTimerModel::flag_update() {
  sr_ |= timer_sr::Update::mask;
  update_interrupt();
}

void GeneralTimerModel::set_encoder_count(std::int64_t edges) {
  // Modulo 2^64, so that no difference overflows.
  auto moved =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(edges) - static_cast<std::uint64_t>(edges_));
  edges_ = edges;
  if (moved == 0 || !running_ || !encoder_mode()) return;
  down_ = (moved < 0) != reversed();
  const std::uint64_t distance =
      moved < 0 ? 0 - static_cast<std::uint64_t>(moved) : static_cast<std::uint64_t>(moved);
  const std::uint64_t range = std::uint64_t{arr_.active} + 1;
  const std::uint64_t rest = distance % range;
  const std::uint64_t target = down_ ? count_ + range - rest : count_ + rest;
  const bool wrapped = distance >= range || (down_ ? target < range : target >= range);
  count_ = static_cast<std::uint32_t>(target % range);
  if (!wrapped) return;
  load_preloaded();
  flag_update();
}

bool GeneralTimerModel::captures(unsigned channel) const {
  const unsigned index = channel - 1;
  const std::uint32_t mode = ccmr_[index / 2] >> (timer_ccmr::bits_per_channel * (index % 2));
  const std::uint32_t enable = ccer_ >> (timer_ccer::bits_per_channel * index);
  return timer_ccmr::Selection<1>::of(mode) == timer_ccmr::input_of_own_pin &&
         timer_ccer::Enable<1>::of(enable) != 0;
}

/// Section Input capture mode: CCxP = CCxNP = 0 rising, CCxP alone falling, both = both edges.
void GeneralTimerModel::capture_edge(unsigned channel, bool rising, BoardTime now) {
  if (channel < 1 || channel > captured_.size()) {
    throw std::invalid_argument(std::string(name_) + " has no channel " + std::to_string(channel) +
                                "; 1 to 4 are allowed");
  }
  advance(now);
  if (!captures(channel)) return;
  const std::uint32_t polarity = ccer_ >> (timer_ccer::bits_per_channel * (channel - 1));
  const bool inverted = timer_ccer::Polarity<1>::of(polarity) != 0;
  const bool both = inverted && timer_ccer::ComplementaryPolarity<1>::of(polarity) != 0;
  if (!both && rising == inverted) return;
  const std::uint32_t flag = timer_sr::CaptureCompare<1>::mask << (channel - 1);
  const std::uint32_t overcapture = timer_sr::Overcapture<1>::mask << (channel - 1);
  if ((sr_ & flag) != 0) sr_ |= overcapture;
  sr_ |= flag;
  captured_[channel - 1] = count(now);
  update_interrupt();
}

void GeneralTimerModel::update_interrupt() {
  constexpr std::uint32_t sources = timer_sr::Update::mask | timer_sr::CaptureCompare<1>::mask |
                                    timer_sr::CaptureCompare<2>::mask | timer_sr::CaptureCompare<3>::mask |
                                    timer_sr::CaptureCompare<4>::mask;
  // DIER enables each of them with the bit that SR shows it in.
  const bool level = (sr_ & dier_ & sources) != 0;
  if (level == level_) return;
  level_ = level;
  interrupts_.set_level(interrupt_, level);
}

}  // namespace kmax::virtual_board
