#include "host_tools/virtual_board/stm32f4/adc.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/adc.hpp"

namespace kmax::virtual_board {

namespace {

namespace adc_ccr = drivers::stm32f4::adc_ccr;
namespace adc_cr1 = drivers::stm32f4::adc_cr1;
namespace adc_cr2 = drivers::stm32f4::adc_cr2;
namespace adc_jsqr = drivers::stm32f4::adc_jsqr;
namespace adc_sqr3 = drivers::stm32f4::adc_sqr3;
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
using Registers = drivers::stm32f4::AdcRegisters;

constexpr const char* common_name = "ADC common registers";
const char* name_of(unsigned number) {
  constexpr std::array names{"ADC1", "ADC2", "ADC3"};
  return names[number - 1];
}

constexpr std::uint32_t cr1_modelled = adc_cr1::InjectedEndInterrupt::mask | adc_cr1::Scan::mask;
constexpr std::uint32_t cr2_stored =
    adc_cr2::On::mask | adc_cr2::InjectedTrigger::mask | adc_cr2::InjectedTriggerEdge::mask;
constexpr std::uint32_t cr2_modelled =
    cr2_stored | adc_cr2::StartInjected::mask | adc_cr2::StartRegular::mask;

}  // namespace

AdcModel::AdcModel(const BoardClocks& clocks, InterruptLines& interrupts, Input volts)
    : clocks_(clocks), interrupts_(interrupts), volts_(std::move(volts)) {
  for (unsigned i = 0; i < converters_.size(); ++i) converters_[i].number = i + 1;
}

std::uint32_t AdcModel::code_of(double volts) {
  if (std::isnan(volts)) throw RefusedAccess("ADC: the voltage to convert is not a number");
  return static_cast<std::uint32_t>(std::clamp(std::floor(volts * (4096.0 / 3.3) + 0.5), 0.0, 4095.0));
}

std::uint32_t AdcModel::read(const Access& access) {
  advance(access.now);
  const std::uint32_t block = access.offset / adc_stride;
  if (block >= converters_.size()) return read_common(access);
  Converter& adc = converters_[block];
  require_word(access, name_of(adc.number));
  const std::uint32_t offset = access.offset % adc_stride;
  switch (offset) {
    case offsetof(Registers, sr):
      return adc.sr;
    case offsetof(Registers, cr1):
      return adc.cr1;
    case offsetof(Registers, cr2):
      return adc.cr2;
    case offsetof(Registers, smpr1):
      return adc.smpr1;
    case offsetof(Registers, smpr2):
      return adc.smpr2;
    case offsetof(Registers, sqr1):
      return 0;
    case offsetof(Registers, sqr3):
      return adc.sqr3;
    case offsetof(Registers, jsqr):
      return adc.jsqr;
    case offsetof(Registers, dr):
      adc.sr &= ~adc_sr::RegularEnd::mask;
      return adc.dr;
    default:
      break;
  }
  constexpr std::uint32_t data = offsetof(Registers, jdr);
  if (offset >= data && offset < data + 16) return adc.jdr[(offset - data) / 4];
  refuse(access, name_of(adc.number), "register not modelled");
}

std::uint32_t AdcModel::read_common(const Access& access) const {
  require_word(access, common_name);
  switch (access.offset - 3 * adc_stride) {
    case offsetof(Common, csr):
      return converters_[0].sr | converters_[1].sr << 8 | converters_[2].sr << 16;
    case offsetof(Common, ccr):
      return ccr_;
    default:
      refuse(access, common_name, "register not modelled");
  }
}

void AdcModel::write(const Access& access, std::uint32_t value) {
  advance(access.now);
  const std::uint32_t block = access.offset / adc_stride;
  if (block >= converters_.size()) {
    write_common(access, value);
    return;
  }
  Converter& adc = converters_[block];
  const char* const name = name_of(adc.number);
  require_word(access, name);
  switch (access.offset % adc_stride) {
    case offsetof(Registers, sr):
      if ((value & ~adc_sr::all) != 0) refuse(access, name, "reserved bits of SR are written 1");
      adc.sr &= value;
      break;
    case offsetof(Registers, cr1):
      write_cr1(adc, access, value);
      break;
    case offsetof(Registers, cr2):
      write_cr2(adc, access, value);
      break;
    case offsetof(Registers, smpr1):
      write_sampling(adc, access, adc.smpr1, value, 9);
      break;
    case offsetof(Registers, smpr2):
      write_sampling(adc, access, adc.smpr2, value, 10);
      break;
    case offsetof(Registers, sqr1):
      if (value != 0) refuse(access, name, "regular sequences of more than one conversion are not modelled");
      break;
    case offsetof(Registers, sqr3):
      if (value > adc_sqr3::First::maximum) refuse(access, name, "only SQ1 of SQR3 is modelled");
      if (adc.regular_running) refuse(access, name, "SQR3 is written while a regular conversion runs");
      adc.sqr3 = value;
      break;
    case offsetof(Registers, jsqr):
      write_list(adc, access, value);
      break;
    default:
      refuse(access, name, "register not modelled or not writable");
  }
  settle();
}

void AdcModel::write_common(const Access& access, std::uint32_t value) {
  require_word(access, common_name);
  if (access.offset - 3 * adc_stride != offsetof(Common, ccr)) {
    refuse(access, common_name, "register not modelled or not writable");
  }
  if ((value & ~adc_ccr::Prescaler::mask) != 0) {
    refuse(access, common_name,
           "CCR: only ADCPRE is modelled (each converter on its own, no internal channels)");
  }
  for (const Converter& adc : converters_) {
    if (adc.injected_running || adc.regular_running) {
      refuse(access, common_name, "ADCPRE is written while a conversion runs");
    }
  }
  ccr_ = value;
}

void AdcModel::write_cr1(Converter& adc, const Access& access, std::uint32_t value) {
  if ((value & ~cr1_modelled) != 0)
    refuse(access, name_of(adc.number), "CR1: only JEOCIE and SCAN are modelled");
  adc.cr1 = value;
}

void AdcModel::write_cr2(Converter& adc, const Access& access, std::uint32_t value) {
  const char* const name = name_of(adc.number);
  if ((value & ~cr2_modelled) != 0) {
    refuse(access, name, "CR2: only ADON, JEXTSEL, JEXTEN, JSWSTART and SWSTART are modelled");
  }
  const std::uint32_t edge = adc_cr2::InjectedTriggerEdge::of(value);
  if (edge != 0 && (edge != adc_cr2::rising || adc_cr2::InjectedTrigger::of(value) != adc_cr2::timer1_trgo)) {
    refuse(access, name, "the only injected trigger modelled is T1_TRGO (JEXTSEL 1), rising edge (JEXTEN 1)");
  }
  const bool on = (value & adc_cr2::On::mask) != 0;
  if (on && adc.on_since == never) adc.on_since = access.now;
  if (!on) {
    // Power-down stops what runs (section ADC on-off control).
    adc.on_since = never;
    adc.injected_running = adc.regular_running = adc.regular_waiting = false;
  }
  adc.cr2 = value & cr2_stored;
  if ((value & adc_cr2::StartRegular::mask) != 0) start_regular(adc, access.now);
  if ((value & adc_cr2::StartInjected::mask) != 0) start_injected(adc, access.now);
}

void AdcModel::write_list(Converter& adc, const Access& access, std::uint32_t value) {
  const char* const name = name_of(adc.number);
  if ((value & ~(adc_jsqr::LastIndex::mask | adc_jsqr::Channels::mask)) != 0) {
    refuse(access, name, "reserved bits of JSQR are written 1");
  }
  const unsigned count = adc_jsqr::LastIndex::of(value) + 1;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned channel = value >> adc_jsqr::position(i, count) & adc_jsqr::channel_mask;
    if (!adc_reaches(adc.number, channel)) {
      refuse(access, name,
             "JSQR names channel " + std::to_string(channel) +
                 ", which this converter does not reach on this package");
    }
  }
  adc.jsqr = value;
  if (!adc.injected_running) return;
  ++adc.restarted_groups;
  adc.injected_running = false;
  start_injected(adc, access.now);
}

void AdcModel::write_sampling(Converter& adc, const Access& access, std::uint32_t& target,
                              std::uint32_t value, unsigned channels) {
  if (value >> (3 * channels) != 0)
    refuse(access, name_of(adc.number), "reserved bits of SMPR are written 1");
  if (adc.injected_running || adc.regular_running) {
    refuse(access, name_of(adc.number), "a sampling time is written while a conversion runs");
  }
  target = value;
}

BoardTime AdcModel::clock_period() const {
  return clocks_.apb2 * 2 * (adc_ccr::Prescaler::of(ccr_) + 1);
}

void AdcModel::require_ready(const Converter& adc, BoardTime now) const {
  const std::string name = name_of(adc.number);
  if (adc.on_since == never) throw RefusedAccess(name + ": a conversion is started while ADON is 0");
  if (now - adc.on_since < adc_stabilization_us * units_per_microsecond) {
    throw RefusedAccess(name + ": a conversion is started " + std::to_string(now - adc.on_since) +
                        "/336 us after ADON; tSTAB is 3 us");
  }
  if (clock_period() * adc_maximum_clock_hz < units_per_second) {
    throw RefusedAccess(name + ": ADC clock of " + std::to_string(units_per_second / clock_period()) +
                        " Hz; 36 MHz are allowed: raise ADCPRE");
  }
}

AdcModel::Conversion AdcModel::conversion(const Converter& adc, unsigned channel, BoardTime begin) const {
  const std::uint32_t times = adc_sampling_in_smpr1(channel) ? adc.smpr1 : adc.smpr2;
  const unsigned sampling = adc_sampling_cycles[times >> adc_sampling_position(channel) & 7U];
  Conversion result;
  result.channel = channel;
  result.held_at = begin + sampling * clock_period();
  result.ends_at = result.held_at + adc_conversion_cycles * clock_period();
  return result;
}

void AdcModel::trigger_injected(BoardTime now) {
  advance(now);
  for (Converter& adc : converters_) {
    if (adc_cr2::InjectedTriggerEdge::of(adc.cr2) != 0) start_injected(adc, now);
  }
  settle();
}

void AdcModel::start_injected(Converter& adc, BoardTime now) {
  if (adc.injected_running) {
    ++adc.ignored_triggers;
    return;
  }
  require_ready(adc, now);
  adc.count = adc_jsqr::LastIndex::of(adc.jsqr) + 1;
  if (adc.count > 1 && (adc.cr1 & adc_cr1::Scan::mask) == 0) {
    throw RefusedAccess(std::string(name_of(adc.number)) + ": an injected group of " +
                        std::to_string(adc.count) + " is started with SCAN = 0; set SCAN");
  }
  // The reset value of JSQR names channel 0, which each converter reaches.
  if (std::exchange(adc.regular_running, false)) adc.regular_waiting = true;
  adc.injected_running = true;
  adc.index = 0;
  adc.sr |= adc_sr::InjectedStarted::mask;
  adc.group_ends_at = now;
  for (unsigned i = adc.count; i-- > 0;) {
    const unsigned channel = adc.jsqr >> adc_jsqr::position(i, adc.count) & adc_jsqr::channel_mask;
    adc.injected = conversion(adc, channel, now);  // the first one remains
    adc.group_ends_at += adc.injected.ends_at - now;
  }
}

void AdcModel::start_regular(Converter& adc, BoardTime now) {
  require_ready(adc, now);
  if (!adc_reaches(adc.number, adc.sqr3)) {
    throw RefusedAccess(std::string(name_of(adc.number)) + ": SQR3 names channel " +
                        std::to_string(adc.sqr3) + ", which this converter does not reach on this package");
  }
  if (adc.regular_running) {
    throw RefusedAccess(std::string(name_of(adc.number)) + ": SWSTART while a regular conversion runs");
  }
  if (adc.injected_running) {
    adc.regular_waiting = true;
    return;
  }
  adc.regular_waiting = false;
  adc.regular_running = true;
  adc.sr |= adc_sr::RegularStarted::mask;
  adc.regular = conversion(adc, adc.sqr3, now);
}

void AdcModel::hold(Conversion& conversion) const {
  conversion.code = code_of(volts_(conversion.channel, conversion.held_at));
  conversion.held = true;
}

/// Does the next thing that is due on this converter; false when there is none.
bool AdcModel::step(Converter& adc, BoardTime now) {
  if (!adc.injected_running && !adc.regular_running) return false;
  Conversion& current = adc.injected_running ? adc.injected : adc.regular;
  if (!current.held) {
    if (current.held_at > now) return false;
    hold(current);
  }
  if (current.ends_at > now) return false;
  const BoardTime ended = current.ends_at;
  if (!adc.injected_running) {
    adc.dr = current.code;
    adc.sr |= adc_sr::RegularEnd::mask;
    adc.regular_running = false;
    return true;
  }
  adc.jdr[adc.index] = current.code;
  if (++adc.index < adc.count) {
    const unsigned channel = adc.jsqr >> adc_jsqr::position(adc.index, adc.count) & adc_jsqr::channel_mask;
    adc.injected = conversion(adc, channel, ended);
    return true;
  }
  adc.injected_running = false;
  adc.sr |= adc_sr::InjectedEnd::mask;
  if (adc.regular_waiting) start_regular(adc, ended);
  return true;
}

void AdcModel::advance(BoardTime now) {
  bool any = false;
  for (Converter& adc : converters_) {
    if (!adc.injected_running && !adc.regular_running) continue;
    any = true;
    while (step(adc, now)) {
    }
  }
  if (any) settle();
}

void AdcModel::settle() {
  next_event_ = never;
  bool interrupt = false;
  for (const Converter& adc : converters_) {
    if ((adc.sr & adc_sr::InjectedEnd::mask) != 0 && (adc.cr1 & adc_cr1::InjectedEndInterrupt::mask) != 0) {
      interrupt = true;
    }
    if (adc.injected_running) {
      const bool to_hold = adc.count == 1 && !adc.injected.held;
      // A clock that became slower in between moves the end of the group behind what was reckoned.
      const BoardTime ends_at = std::max(adc.group_ends_at, adc.injected.ends_at);
      next_event_ = std::min(next_event_, to_hold ? adc.injected.held_at : ends_at);
    } else if (adc.regular_running) {
      next_event_ = std::min(next_event_, adc.regular.held ? adc.regular.ends_at : adc.regular.held_at);
    }
  }
  if (interrupt != interrupt_) {
    interrupt_ = interrupt;
    interrupts_.set_level(drivers::stm32f4::Interrupt::adc, interrupt);
  }
}

void AdcModel::reset(BoardTime now) {
  static_cast<void>(now);
  for (Converter& adc : converters_) {
    const unsigned number = adc.number;
    adc = Converter{};
    adc.number = number;
  }
  ccr_ = 0;
  settle();
}

}  // namespace kmax::virtual_board
