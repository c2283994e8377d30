#include "host_tools/virtual_board/stm32f4/general_timer.hpp"

#include <cstddef>
#include <stdexcept>
#include <string>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::Interrupt;
using drivers::stm32f4::TimerRegisters;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_dier = drivers::stm32f4::timer_dier;
namespace timer_egr = drivers::stm32f4::timer_egr;
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

constexpr std::uint32_t cr1_writable = timer_cr1::Enable::mask | timer_cr1::UpdateRequestSource::mask |
                                       timer_cr1::CountingDown::mask | timer_cr1::AutoReloadPreload::mask |
                                       timer_cr1::ClockDivision::mask;
constexpr std::uint32_t cr1_of_counter = timer_cr1::Enable::mask | timer_cr1::CountingDown::mask;
/// DIER enables each interrupt with the bit in which SR shows its flag.
constexpr std::uint32_t dier_writable = timer_sr::Update::mask | timer_sr::CaptureCompare<1>::mask |
                                        timer_sr::CaptureCompare<2>::mask |
                                        timer_sr::CaptureCompare<3>::mask | timer_sr::CaptureCompare<4>::mask;
constexpr std::uint32_t input_fields = timer_ccmr::Selection<1>::mask | timer_ccmr::InputFilter<1>::mask;
constexpr std::uint32_t ccmr_writable = input_fields | input_fields << timer_ccmr::bits_per_channel;
constexpr std::uint32_t channel_writable =
    timer_ccer::Enable<1>::mask | timer_ccer::Polarity<1>::mask | timer_ccer::ComplementaryPolarity<1>::mask;
constexpr std::uint32_t ccer_writable = channel_writable | channel_writable << timer_ccer::bits_per_channel |
                                        channel_writable << 2 * timer_ccer::bits_per_channel |
                                        channel_writable << 3 * timer_ccer::bits_per_channel;

}  // namespace

GeneralTimerModel::GeneralTimerModel(GeneralTimer unit, const BoardClocks& clocks, InterruptLines& interrupts)
    : RegisterBlock(units.at(static_cast<std::size_t>(unit)).name, registers()),
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
  return timer_ccmr::Selection<1>::of(channel_mode(ccmr_, channel - 1)) == timer_ccmr::input_of_own_pin &&
         timer_ccer::Enable<1>::of(channel_switches(ccer_, channel - 1)) != 0;
}

/// Section Input capture mode: CCxP = CCxNP = 0 rising, CCxP alone falling, both = both edges.
void GeneralTimerModel::capture_edge(unsigned channel, bool rising, BoardTime now) {
  if (channel < 1 || channel > captured_.size()) {
    throw std::invalid_argument(std::string(block()) + " has no channel " + std::to_string(channel) +
                                "; 1 to 4 are allowed");
  }
  advance(now);
  if (!captures(channel)) return;
  const std::uint32_t polarity = channel_switches(ccer_, channel - 1);
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
  const bool level = (sr_ & dier_) != 0;
  if (level == level_) return;
  level_ = level;
  interrupts_.set_level(interrupt_, level);
}

const RegisterTable<GeneralTimerModel>& GeneralTimerModel::registers() {
  using Model = GeneralTimerModel;
  using Row = Register<Model>;
  using Layout = TimerRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cr1), "CR1", Row::shows<&Model::read_cr1>, cr1_writable,
       Row::takes<&Model::write_cr1>},
      Row::reserved(offsetof(Layout, cr2), "CR2"),
      {offsetof(Layout, smcr), "SMCR", Row::shows<&Model::smcr_>, timer_smcr::SlaveMode::mask,
       Row::takes<&Model::write_smcr>},
      Row::word<&Model::dier_>(offsetof(Layout, dier), "DIER", dier_writable),
      {offsetof(Layout, sr), "SR", Row::shows<&Model::sr_>, any_bits, Row::clears_by_zeros<&Model::sr_>},
      {offsetof(Layout, egr), "EGR", Row::zero, timer_egr::Update::mask, Row::takes<&Model::write_egr>},
      {offsetof(Layout, ccmr[0]), "CCMR1", Row::shows<&Model::ccmr_, 0>, ccmr_writable,
       Row::takes<&Model::write_ccmr, 0>},
      {offsetof(Layout, ccmr[1]), "CCMR2", Row::shows<&Model::ccmr_, 1>, ccmr_writable,
       Row::takes<&Model::write_ccmr, 1>},
      {offsetof(Layout, ccer), "CCER", Row::shows<&Model::ccer_>, ccer_writable,
       Row::takes<&Model::write_ccer>},
      {offsetof(Layout, cnt), "CNT", Row::shows<&Model::read_cnt>, any_bits, Row::takes<&Model::write_cnt>},
      Row::word<&Model::psc_, &PreloadedWord::preload>(offsetof(Layout, psc), "PSC", 0xFFFF),
      {offsetof(Layout, arr), "ARR", Row::shows<&Model::arr_, &PreloadedWord::preload>, any_bits,
       Row::takes<&Model::write_arr>},
      {offsetof(Layout, ccr[0]), "CCR1", Row::shows<&Model::read_capture, 1>, 0, Row::nothing},
      {offsetof(Layout, ccr[1]), "CCR2", Row::shows<&Model::read_capture, 2>, 0, Row::nothing},
      {offsetof(Layout, ccr[2]), "CCR3", Row::shows<&Model::read_capture, 3>, 0, Row::nothing},
      {offsetof(Layout, ccr[3]), "CCR4", Row::shows<&Model::read_capture, 4>, 0, Row::nothing}};
  return table;
}

std::uint32_t GeneralTimerModel::read_cr1() const {
  return cr1_ | timer_cr1::Enable::bits(running_ ? 1 : 0) | timer_cr1::CountingDown::bits(down_ ? 1 : 0);
}

void GeneralTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  if (timer_cr1::ClockDivision::of(value) == 3) refuse(access, "CKD = 3 is reserved");
  // In encoder mode DIR is the hardware's.
  if (!encoder_mode()) down_ = timer_cr1::CountingDown::of(value) != 0;
  const bool enable = timer_cr1::Enable::of(value) != 0;
  const bool was_preloaded = timer_cr1::AutoReloadPreload::of(cr1_) != 0;
  cr1_ = value & ~cr1_of_counter;
  if (was_preloaded && timer_cr1::AutoReloadPreload::of(cr1_) == 0 && arr_.active != arr_.preload) {
    refuse(access, "ARPE is cleared while a new ARR waits for the update event");
  }
  if (enable == running_) {
    if (running_ && down_ && !encoder_mode()) refuse(access, "down-counting (DIR = 1) is not modelled");
    return;
  }
  if (!enable) return stop(access.now);
  if (arr_.active == 0) refuse(access, "the counter is started with ARR = 0, which blocks it");
  if (count_ > arr_.active) {
    refuse(access, "the counter is started at " + std::to_string(count_) +
                       ", above ARR = " + std::to_string(arr_.active));
  }
  if (encoder_mode()) {
    require_encoder_inputs(access);
  } else if (down_) {
    refuse(access, "down-counting (DIR = 1) is not modelled");
  }
  start(access.now);
}

/// Section Encoder interface mode: both inputs on their own pins. The polarity "both edges" must not be used.
void GeneralTimerModel::require_encoder_inputs(const Access& access) const {
  if (psc_.active != 0) refuse(access, "encoder mode with a prescaler (PSC) is not modelled");
  for (unsigned index = 0; index < 2; ++index) {
    const std::uint32_t polarity = channel_switches(ccer_, index);
    if (timer_ccmr::Selection<1>::of(channel_mode(ccmr_, index)) != timer_ccmr::input_of_own_pin ||
        timer_ccer::ComplementaryPolarity<1>::of(polarity) != 0) {
      refuse(access, "encoder mode needs CC" + std::to_string(index + 1) + "S = 1 and CC" +
                         std::to_string(index + 1) + "NP = 0");
    }
  }
}

void GeneralTimerModel::write_smcr(const Access& access, std::uint32_t value) {
  const std::uint32_t mode = timer_smcr::SlaveMode::of(value);
  if (mode != timer_smcr::slave_off && mode != timer_smcr::slave_encoder_both_inputs) {
    refuse(access, "SMS = " + std::to_string(mode) + " is not modelled; 0 and 3 (encoder) are");
  }
  if (value != smcr_ && running_) refuse(access, "SMS is changed while the counter runs");
  smcr_ = value;
}

void GeneralTimerModel::write_ccmr(const Access& access, unsigned index, std::uint32_t value) {
  for (unsigned channel = 2 * index; channel < 2 * index + 2; ++channel) {
    const unsigned shift = timer_ccmr::bits_per_channel * (channel % 2);
    const std::uint32_t selection = timer_ccmr::Selection<1>::of(value >> shift);
    if (selection > timer_ccmr::input_of_own_pin) {
      refuse(access, "CCxS = " + std::to_string(selection) + " is not modelled; 1 (own pin) is");
    }
    if (selection == 0 && timer_ccmr::InputFilter<1>::of(value >> shift) != 0) {
      refuse(access, "compare outputs (CCxS = 0 with OCxM) are not modelled");
    }
    const bool on = timer_ccer::Enable<1>::of(channel_switches(ccer_, channel)) != 0;
    if (on && selection != timer_ccmr::Selection<1>::of(ccmr_[index] >> shift)) {
      refuse(access, "CCxS is writable only while its channel is off (CCxE = 0)");
    }
  }
  if (running_ && encoder_mode() && index == 0 && value != ccmr_[0]) {
    refuse(access, "CCMR1 is changed while the encoder is being counted");
  }
  ccmr_[index] = value;
}

void GeneralTimerModel::write_ccer(const Access& access, std::uint32_t value) {
  for (unsigned index = 0; index < captured_.size(); ++index) {
    const std::uint32_t channel = channel_switches(value, index);
    if (timer_ccer::Enable<1>::of(channel) != 0 &&
        timer_ccmr::Selection<1>::of(channel_mode(ccmr_, index)) == 0) {
      refuse(access, "CC" + std::to_string(index + 1) + "E enables a compare output, which is not modelled");
    }
    if (timer_ccer::ComplementaryPolarity<1>::of(channel) != 0 && timer_ccer::Polarity<1>::of(channel) == 0) {
      refuse(access, "CCxNP = 1 with CCxP = 0 is reserved for an input");
    }
  }
  ccer_ = value;
  if (running_ && encoder_mode()) require_encoder_inputs(access);
}

void GeneralTimerModel::write_egr(const Access& access, std::uint32_t value) {
  if (value != 0) software_update(access.now);
}

void GeneralTimerModel::write_cnt(const Access& access, std::uint32_t value) {
  if (value > arr_.active) {
    refuse(access, "CNT = " + std::to_string(value) + " is above ARR = " + std::to_string(arr_.active));
  }
  count_from(access.now, value);
}

void GeneralTimerModel::write_arr(const Access& access, std::uint32_t value) {
  if (value > longest_) refuse(access, "ARR = " + std::to_string(value) + " does not fit into the counter");
  if (timer_cr1::AutoReloadPreload::of(cr1_) == 0) {
    if (running_ && (value == 0 || value < count(access.now))) {
      refuse(access,
             "ARR = " + std::to_string(value) + " is written without preload below the running count");
    }
    const std::uint32_t present = count(access.now);
    const BoardTime since_tick = running_ && !encoder_mode() ? (access.now - origin_) % tick_ : 0;
    arr_.active = value;
    if (running_) count_from(access.now - since_tick, present);
  } else if (value == 0) {
    refuse(access, "ARR = 0 blocks the counter; 1 and above are allowed");
  }
  arr_.preload = value;
}

std::uint32_t GeneralTimerModel::read_capture(unsigned channel) {
  if (captures(channel)) {
    sr_ &= ~(timer_sr::CaptureCompare<1>::mask << (channel - 1));
    update_interrupt();
  }
  return captured_[channel - 1];
}

}  // namespace kmax::virtual_board
