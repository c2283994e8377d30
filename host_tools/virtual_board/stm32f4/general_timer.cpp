#include "host_tools/virtual_board/stm32f4/general_timer.hpp"

#include <fmt/format.h>

#include <array>
#include <cstddef>

#include "drivers/stm32f4/registers/timer.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::TimerRegisters;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_egr = drivers::stm32f4::timer_egr;
namespace timer_smcr = drivers::stm32f4::timer_smcr;
namespace timer_sr = drivers::stm32f4::timer_sr;

struct Unit {
  const char* name;
  std::uint32_t longest;
};
constexpr std::array<Unit, 4> units{Unit{"TIM2", 0xFFFF'FFFF}, Unit{"TIM3", 0xFFFF}, Unit{"TIM4", 0xFFFF},
                                    Unit{"TIM5", 0xFFFF'FFFF}};

constexpr std::uint32_t cr1_settings = timer_cr1::UpdateRequestSource::mask;
constexpr std::uint32_t cr1_from_counter = timer_cr1::Enable::mask | timer_cr1::CountingDown::mask;
constexpr std::uint32_t input_fields = timer_ccmr::Selection<1>::mask | timer_ccmr::InputFilter<1>::mask;
constexpr std::uint32_t both_inputs = timer_ccmr::Selection<1>::bits(timer_ccmr::input_of_own_pin) |
                                      timer_ccmr::Selection<2>::bits(timer_ccmr::input_of_own_pin);

}  // namespace

GeneralTimerModel::GeneralTimerModel(GeneralTimer unit, const BoardClocks& clocks)
    : RegisterBlock(units.at(static_cast<std::size_t>(unit)).name, registers()),
      clocks_(clocks),
      longest_(units.at(static_cast<std::size_t>(unit)).longest) {
  reset(0);
}

void GeneralTimerModel::reset(BoardTime /*now*/) {
  cr1_ = smcr_ = sr_ = ccmr_ = ccer_ = count_ = 0;
  arr_ = longest_;
  running_ = down_ = false;
}

bool GeneralTimerModel::encoder_mode() const {
  return timer_smcr::SlaveMode::of(smcr_) == timer_smcr::slave_encoder_both_inputs;
}

// RM0090, TIMx_CCMR1, IC1F: clocks from one sample to the next, and how many must agree.
double GeneralTimerModel::input_filter() const {
  constexpr std::array<std::array<int, 2>, 16> filters{{{1, 0},
                                                        {1, 2},
                                                        {1, 4},
                                                        {1, 8},
                                                        {2, 6},
                                                        {2, 8},
                                                        {4, 6},
                                                        {4, 8},
                                                        {8, 6},
                                                        {8, 8},
                                                        {16, 5},
                                                        {16, 6},
                                                        {16, 8},
                                                        {32, 5},
                                                        {32, 6},
                                                        {32, 8}}};
  const auto [interval, samples] = filters.at(timer_ccmr::InputFilter<1>::of(ccmr_));
  return interval * samples * seconds(clocks_.apb1_timer);
}

void GeneralTimerModel::set_encoder_count(std::int64_t edges) {
  // Modulo 2^64, so that no difference overflows.
  const auto moved =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(edges) - static_cast<std::uint64_t>(edges_));
  edges_ = edges;
  if (moved == 0 || !running_) return;
  // Each input that is inverted turns the direction round: table Counting direction versus encoder signals.
  const bool reversed = timer_ccer::Polarity<1>::of(ccer_) != timer_ccer::Polarity<2>::of(ccer_);
  down_ = (moved < 0) != reversed;
  const std::uint64_t distance =
      moved < 0 ? 0 - static_cast<std::uint64_t>(moved) : static_cast<std::uint64_t>(moved);
  const std::uint64_t range = std::uint64_t{arr_} + 1;
  const std::uint64_t rest = distance % range;
  const std::uint64_t target = down_ ? count_ + range - rest : count_ + rest;
  if (distance >= range || (down_ ? target < range : target >= range)) sr_ |= timer_sr::Update::mask;
  count_ = static_cast<std::uint32_t>(target % range);
}

const RegisterTable<GeneralTimerModel>& GeneralTimerModel::registers() {
  using Model = GeneralTimerModel;
  using Row = Register<Model>;
  using Layout = TimerRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cr1), "CR1", Row::shows<&Model::read_cr1>, cr1_settings | cr1_from_counter,
       Row::takes<&Model::write_cr1>},
      Row::reserved(offsetof(Layout, cr2), "CR2"),
      {offsetof(Layout, smcr), "SMCR", Row::shows<&Model::smcr_>, timer_smcr::SlaveMode::mask,
       Row::takes<&Model::write_smcr>},
      Row::reserved(offsetof(Layout, dier), "DIER"),
      {offsetof(Layout, sr), "SR", Row::shows<&Model::sr_>, any_bits, Row::clears_by_zeros<&Model::sr_>},
      {offsetof(Layout, egr), "EGR", Row::zero, timer_egr::Update::mask, Row::takes<&Model::write_egr>},
      {offsetof(Layout, ccmr[0]), "CCMR1", Row::shows<&Model::ccmr_>,
       input_fields | input_fields << timer_ccmr::bits_per_channel, Row::takes<&Model::write_inputs>},
      Row::reserved(offsetof(Layout, ccmr[1]), "CCMR2"),
      {offsetof(Layout, ccer), "CCER", Row::shows<&Model::ccer_>,
       timer_ccer::Polarity<1>::mask | timer_ccer::Polarity<2>::mask, Row::takes<&Model::write_ccer>},
      {offsetof(Layout, cnt), "CNT", Row::shows<&Model::count_>, any_bits, Row::takes<&Model::write_cnt>},
      Row::reserved(offsetof(Layout, psc), "PSC"),
      {offsetof(Layout, arr), "ARR", Row::shows<&Model::arr_>, any_bits, Row::takes<&Model::write_arr>}};
  return table;
}

std::uint32_t GeneralTimerModel::read_cr1() const {
  return cr1_ | timer_cr1::Enable::bits(running_ ? 1 : 0) | timer_cr1::CountingDown::bits(down_ ? 1 : 0);
}

void GeneralTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  // In encoder mode DIR is the hardware's.
  if (!encoder_mode()) down_ = timer_cr1::CountingDown::of(value) != 0;
  cr1_ = value & cr1_settings;
  const bool start = timer_cr1::Enable::of(value) != 0 && !running_;
  running_ = timer_cr1::Enable::of(value) != 0;
  if (!start) return;
  if (!encoder_mode()) refuse(access, "counting by the clock is not modelled; encoder mode (SMS = 3) is");
  if (count_ > arr_) refuse(access, fmt::format("started at {}, above ARR = {}", count_, arr_));
  if ((ccmr_ & both_inputs) != both_inputs) refuse(access, "encoder mode needs CC1S = CC2S = 1");
}

void GeneralTimerModel::write_smcr(const Access& access, std::uint32_t value) {
  const std::uint32_t mode = timer_smcr::SlaveMode::of(value);
  if (mode != timer_smcr::slave_off && mode != timer_smcr::slave_encoder_both_inputs)
    refuse(access, fmt::format("SMS = {} is not modelled; 0 and 3 (encoder) are", mode));
  if (value != smcr_ && running_) refuse(access, "SMS is changed while the counter runs");
  smcr_ = value;
}

/// UG: register TIMx_EGR. It loads ARR instead of 0 when the direction is down, as it may be in encoder mode.
void GeneralTimerModel::write_egr(std::uint32_t value) {
  if (value == 0) return;
  count_ = down_ ? arr_ : 0;
  if (timer_cr1::UpdateRequestSource::of(cr1_) == 0) sr_ |= timer_sr::Update::mask;
}

void GeneralTimerModel::write_inputs(const Access& access, std::uint32_t value) {
  // Of each channel: its own pin, or nothing.
  const std::uint32_t selected = value & (timer_ccmr::Selection<1>::mask | timer_ccmr::Selection<2>::mask);
  if (value != 0 && selected != both_inputs)
    refuse(access, "only inputs from the channels' own pins (CCxS = 1) are modelled");
  if (running_ && value != ccmr_) refuse(access, "CCMR1 is changed while the encoder is being counted");
  ccmr_ = value;
}

void GeneralTimerModel::write_ccer(const Access& access, std::uint32_t value) {
  if (running_ && value != ccer_) refuse(access, "CCER is changed while the encoder is being counted");
  ccer_ = value;
}

void GeneralTimerModel::write_cnt(const Access& access, std::uint32_t value) {
  if (value > arr_) refuse(access, fmt::format("CNT = {} is above ARR = {}", value, arr_));
  count_ = value;
}

void GeneralTimerModel::write_arr(const Access& access, std::uint32_t value) {
  if (value > longest_) refuse(access, fmt::format("ARR = {} does not fit into the counter", value));
  if (value == 0) refuse(access, "ARR = 0 blocks the counter; 1 and above are allowed");
  if (running_ && value < count_) refuse(access, "ARR is written below the running count");
  arr_ = value;
}

}  // namespace kmax::virtual_board
