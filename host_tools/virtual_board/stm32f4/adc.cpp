#include "host_tools/virtual_board/stm32f4/adc.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/adc.hpp"
#include "host_tools/simulation/converter_code.hpp"

namespace kmax::virtual_board {

namespace {

namespace adc_ccr = drivers::stm32f4::adc_ccr;
namespace adc_cr1 = drivers::stm32f4::adc_cr1;
namespace adc_cr2 = drivers::stm32f4::adc_cr2;
namespace adc_jsqr = drivers::stm32f4::adc_jsqr;
namespace adc_sr = drivers::stm32f4::adc_sr;
using drivers::stm32f4::adc_conversion_cycles;
using drivers::stm32f4::adc_maximum_clock_hz;
using drivers::stm32f4::adc_reaches;
using drivers::stm32f4::adc_sampling_cycles;
using drivers::stm32f4::adc_sampling_in_smpr1;
using drivers::stm32f4::adc_sampling_position;
using drivers::stm32f4::adc_stabilization_us;
using drivers::stm32f4::adc_stride;
using Common = drivers::stm32f4::AdcCommonRegisters;
using AdcLayout = drivers::stm32f4::AdcRegisters;

constexpr const char* common_name = "ADC common registers";
constexpr std::uint32_t common_offset = 3 * adc_stride;

constexpr std::uint32_t cr1_modelled = adc_cr1::InjectedEndInterrupt::mask | adc_cr1::Scan::mask;
constexpr std::uint32_t cr2_stored =
    adc_cr2::On::mask | adc_cr2::InjectedTrigger::mask | adc_cr2::InjectedTriggerEdge::mask;
constexpr std::uint32_t cr2_modelled = cr2_stored | adc_cr2::StartInjected::mask;

}  // namespace

AdcModel::AdcModel(const BoardClocks& clocks, InterruptLines& interrupts, Input volts)
    : clocks_(clocks), interrupts_(interrupts), volts_(std::move(volts)) {}

std::uint32_t AdcModel::code_of(double volts) {
  if (std::isnan(volts)) throw RefusedAccess("ADC: the voltage to convert is not a number");
  return simulation::converter_code(volts);
}

const RegisterTable<AdcModel::Converter>& AdcModel::Converter::registers() {
  using Row = Register<Converter>;
  using Model = Converter;
  // A sampling time has three bits: channels 10 to 18 in SMPR1, 0 to 9 in SMPR2.
  constexpr std::uint32_t nine_times = (1U << 27) - 1U, ten_times = (1U << 30) - 1U;
  static const RegisterTable<Converter> table{
      {offsetof(AdcLayout, sr), "SR", Row::shows<&Model::sr>, adc_sr::all, Row::clears_by_zeros<&Model::sr>},
      Row::word<&Model::cr1_>(offsetof(AdcLayout, cr1), "CR1", cr1_modelled),
      {offsetof(AdcLayout, cr2), "CR2", Row::shows<&Model::cr2>, cr2_modelled, Row::takes<&Model::write_cr2>},
      {offsetof(AdcLayout, smpr1), "SMPR1", Row::shows<&Model::smpr1_>, nine_times,
       Row::takes<&Model::write_sampling<&Model::smpr1_>>},
      {offsetof(AdcLayout, smpr2), "SMPR2", Row::shows<&Model::smpr2_>, ten_times,
       Row::takes<&Model::write_sampling<&Model::smpr2_>>},
      Row::reserved(offsetof(AdcLayout, sqr1), "SQR1"),
      Row::reserved(offsetof(AdcLayout, sqr3), "SQR3"),
      {offsetof(AdcLayout, jsqr), "JSQR", Row::shows<&Model::jsqr_>,
       adc_jsqr::LastIndex::mask | adc_jsqr::Channels::mask, Row::takes<&Model::write_list>},
      {offsetof(AdcLayout, jdr[0]), "JDR1", Row::shows<&Model::jdr_, 0>},
      {offsetof(AdcLayout, jdr[1]), "JDR2", Row::shows<&Model::jdr_, 1>},
      {offsetof(AdcLayout, jdr[2]), "JDR3", Row::shows<&Model::jdr_, 2>},
      {offsetof(AdcLayout, jdr[3]), "JDR4", Row::shows<&Model::jdr_, 3>}};
  return table;
}

const RegisterTable<AdcModel>& AdcModel::common_registers() {
  using Row = Register<AdcModel>;
  static const RegisterTable<AdcModel> table{{offsetof(Common, csr), "CSR", Row::shows<&AdcModel::read_csr>},
                                             {offsetof(Common, ccr), "CCR", Row::shows<&AdcModel::ccr_>,
                                              adc_ccr::Prescaler::mask, Row::takes<&AdcModel::write_ccr>}};
  return table;
}

std::uint32_t AdcModel::read(const Access& access) {
  advance(access.now);
  const std::uint32_t block = access.offset / adc_stride;
  if (block >= converters_.size()) {
    const Access common{access.offset - common_offset, access.bytes, access.now};
    return common_registers().read(*this, common_name, common);
  }
  Converter& adc = converters_[block];
  return Converter::registers().read(adc, adc.name(), {access.offset % adc_stride, access.bytes, access.now});
}

void AdcModel::write(const Access& access, std::uint32_t value) {
  advance(access.now);
  const std::uint32_t block = access.offset / adc_stride;
  if (block >= converters_.size()) {
    const Access common{access.offset - common_offset, access.bytes, access.now};
    return common_registers().write(*this, common_name, common, value);
  }
  Converter& adc = converters_[block];
  Converter::registers().write(adc, adc.name(), {access.offset % adc_stride, access.bytes, access.now},
                               value);
  settle();
}

std::uint32_t AdcModel::read_csr() const {
  return converters_[0].sr | converters_[1].sr << 8 | converters_[2].sr << 16;
}

/// Each converter on its own, no internal channels.
void AdcModel::write_ccr(const Access& access, std::uint32_t value) {
  if (std::ranges::any_of(converters_, &Converter::running))
    refuse(access, common_name, "ADCPRE is written while a conversion runs");
  ccr_ = value;
}

void AdcModel::Converter::write_cr2(const Access& access, std::uint32_t value) {
  const std::uint32_t edge = adc_cr2::InjectedTriggerEdge::of(value);
  if (edge != 0 && (edge != adc_cr2::rising || adc_cr2::InjectedTrigger::of(value) != adc_cr2::timer1_trgo)) {
    refuse(access, "the only injected trigger modelled is T1_TRGO (JEXTSEL 1), rising edge (JEXTEN 1)");
  }
  const bool on = (value & adc_cr2::On::mask) != 0;
  if (on && on_since_ == never) on_since_ = access.now;
  if (!on) {
    // Power-down stops what runs (section ADC on-off control).
    on_since_ = never;
    running = false;
  }
  cr2 = value & cr2_stored;
  if ((value & adc_cr2::StartInjected::mask) != 0) start_injected(access.now);
}

void AdcModel::Converter::write_list(const Access& access, std::uint32_t value) {
  const unsigned count = adc_jsqr::LastIndex::of(value) + 1;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned channel = value >> adc_jsqr::position(i, count) & adc_jsqr::channel_mask;
    if (!adc_reaches(number_, channel)) {
      refuse(access, "JSQR names channel " + std::to_string(channel) +
                         ", which this converter does not reach on this package");
    }
  }
  jsqr_ = value;
  if (!running) return;
  ++restarted_groups;
  running = false;
  start_injected(access.now);
}

template <std::uint32_t AdcModel::Converter::*target>
void AdcModel::Converter::write_sampling(const Access& access, std::uint32_t value) {
  if (running) refuse(access, "a sampling time is written while a conversion runs");
  this->*target = value;
}

const char* AdcModel::Converter::name() const {
  constexpr std::array names{"ADC1", "ADC2", "ADC3"};
  return names[number_ - 1];
}

void AdcModel::Converter::refuse_start(const std::string& why) const {
  throw RefusedAccess(std::string(name()) + ": " + why);
}

void AdcModel::Converter::require_ready(BoardTime now) const {
  if (on_since_ == never) refuse_start("a conversion is started while ADON is 0");
  if (now - on_since_ < adc_stabilization_us * units_per_microsecond) {
    refuse_start("a conversion is started " + std::to_string(now - on_since_) +
                 "/336 us after ADON; tSTAB is 3 us");
  }
  const BoardTime period = model_->clock_period();
  if (period * adc_maximum_clock_hz < units_per_second) {
    refuse_start("ADC clock of " + std::to_string(units_per_second / period) +
                 " Hz; 36 MHz are allowed: raise ADCPRE");
  }
}

unsigned AdcModel::Converter::listed_channel(unsigned place) const {
  return jsqr_ >> adc_jsqr::position(place, count_) & adc_jsqr::channel_mask;
}

AdcModel::Conversion AdcModel::Converter::conversion(unsigned channel, BoardTime begin) const {
  const std::uint32_t times = adc_sampling_in_smpr1(channel) ? smpr1_ : smpr2_;
  const unsigned sampling = adc_sampling_cycles[times >> adc_sampling_position(channel) & 7U];
  Conversion result;
  result.channel = channel;
  result.held_at = begin + sampling * model_->clock_period();
  result.ends_at = result.held_at + adc_conversion_cycles * model_->clock_period();
  return result;
}

void AdcModel::Converter::start_injected(BoardTime now) {
  if (running) {
    ++ignored_triggers;
    return;
  }
  require_ready(now);
  count_ = adc_jsqr::LastIndex::of(jsqr_) + 1;
  if (count_ > 1 && (cr1_ & adc_cr1::Scan::mask) == 0) {
    refuse_start("an injected group of " + std::to_string(count_) + " is started with SCAN = 0; set SCAN");
  }
  // The reset value of JSQR names channel 0, which each converter reaches.
  running = true;
  index_ = 0;
  sr |= adc_sr::InjectedStarted::mask;
  group_ends_at_ = now;
  for (unsigned i = count_; i-- > 0;) {
    injected_ = conversion(listed_channel(i), now);  // the first one remains
    group_ends_at_ += injected_.ends_at - now;
  }
}

bool AdcModel::Converter::step(BoardTime now) {
  if (!running) return false;
  if (!injected_.held) {
    if (injected_.held_at > now) return false;
    model_->hold(injected_);
  }
  if (injected_.ends_at > now) return false;
  jdr_[index_] = injected_.code;
  if (++index_ < count_) {
    injected_ = conversion(listed_channel(index_), injected_.ends_at);
    return true;
  }
  running = false;
  sr |= adc_sr::InjectedEnd::mask;
  return true;
}

bool AdcModel::Converter::interrupts() const {
  return (sr & adc_sr::InjectedEnd::mask) != 0 && (cr1_ & adc_cr1::InjectedEndInterrupt::mask) != 0;
}

BoardTime AdcModel::Converter::next_event() const {
  if (!running) return never;
  // A clock that became slower in between moves the end of the group behind what was reckoned.
  const bool to_hold = count_ <= 2 && index_ == 0 && !injected_.held;
  return to_hold ? injected_.held_at : std::max(group_ends_at_, injected_.ends_at);
}

BoardTime AdcModel::clock_period() const {
  return clocks_.apb2 * 2 * (adc_ccr::Prescaler::of(ccr_) + 1);
}

void AdcModel::trigger_injected(BoardTime now) {
  advance(now);
  for (Converter& adc : converters_) {
    if (adc_cr2::InjectedTriggerEdge::of(adc.cr2) != 0) adc.start_injected(now);
  }
  settle();
}

void AdcModel::hold(Conversion& conversion) const {
  conversion.code = code_of(volts_(conversion.channel, conversion.held_at));
  conversion.held = true;
}

void AdcModel::advance(BoardTime now) {
  bool any = false;
  for (Converter& adc : converters_) {
    if (!adc.running) continue;
    any = true;
    while (adc.step(now)) {
    }
  }
  if (any) settle();
}

void AdcModel::settle() {
  next_event_ = never;
  bool interrupt = false;
  for (const Converter& adc : converters_) {
    interrupt = interrupt || adc.interrupts();
    next_event_ = std::min(next_event_, adc.next_event());
  }
  if (interrupt != interrupt_) {
    interrupt_ = interrupt;
    interrupts_.set_level(drivers::stm32f4::Interrupt::adc, interrupt);
  }
}

void AdcModel::reset(BoardTime /*now*/) {
  for (unsigned i = 0; i < converters_.size(); ++i) converters_[i] = Converter{*this, i + 1};
  ccr_ = 0;
  settle();
}

}  // namespace kmax::virtual_board
