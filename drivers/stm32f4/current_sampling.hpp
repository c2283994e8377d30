#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/registers/adc.hpp"

// Phase currents of two axes, supply voltage and temperatures, converted in step with the PWM. RM0090, ADC.
//
// TIM1's update event (TRGO, at underflow and at overflow, every 25 us at 20 kHz PWM) starts the injected
// groups of all three converters at the same instant. Underflow is the sampling point of axis 0, overflow
// that of axis 1, whose timer runs half a period later. ADC2 converts phase B and ADC3 phase C of one axis
// per trigger, and then the same of the other axis, whose high sides conduct: no current passes its shunts,
// and the codes are its amplifiers' offsets. The interrupt that reads them writes the lists of the other axis
// before the next trigger. ADC1 converts the slow quantities on every trigger. The interrupt is ADC2's end of
// sequence alone.
//
// Budget at ADCCLK = 84 MHz / 4 = 21 MHz, a conversion takes its sampling time plus 12 cycles:
//   currents  2 x (3 + 12) = 30 cycles = 1.43 us; the low sides must conduct for the sampling time, 0.14 us,
//             the other axis' high sides for 0.86 us, and the interrupt starts 1.43 us after the trigger
//   ADC1      3 x (28 + 12) = 120 cycles = 5.7 us, so in an interrupt that comes in time its results are of
//             the trigger before, the supply's perhaps of this one (it may come up to 23 us late and still be
//             counted as in time by the lists)
// 28 cycles for the slow ones: the sampling capacitor (4 pF) pulls the 270 pF at the voltage divider's tap
// down by up to 61 codes when the channel changes; that recovers with 909 Ohm x 274 pF = 0.25 us, to half a
// code in 1.2 us = 25 cycles. The thermistors' 2.2 uF need less. Three cycles for the currents are the
// shortest there is; the amplifiers drive through 22 Ohm and 2.2 nF (48 ns), and with the data sheet's
// greatest switch resistance (6 kOhm) up to 0.25 % of the difference to the other axis' current remains.
// `current_sampling_code` = 1 (15 cycles, 0.71 us) removes it when the low-side window allows.
//
// What is checked on every read, and counted:
//   axis_mismatches   the lists in force were not those of the axis that the caller names (it takes the axis
//                     from the timer's direction): the sample is not valid. The lists are set for the next
//                     trigger by the caller's axis, so one good interrupt is enough to be in step again.
//   overruns          a trigger fell between the reading and the writing of the lists (flags up again), or
//                     the same axis came twice in a row: the other's sample was lost. An even number of lost
//                     triggers looks like none: flags hold one bit. The caller sees that by its clock.
//   missing_phase_c   ADC2 was done, ADC3 not.
//   spurious          called without a finished conversion; nothing was touched.
// A lost interrupt counts as overrun and mismatch. A mismatch alone means that caller and trigger disagree on
// the phase. One gap remains: a trigger in the few cycles between the caller's look at the timer and the
// clearing of the flags. A caller that finds the timer's direction unchanged after ISR_read knows that there
// was none.
//
// Order: `configure` (timers' trigger still off or not), wait adc_stabilization_us, `start`. The converters'
// clocks, the pins (analog mode) and the NVIC are the composition root's.
//
// Cost of ISR_read: 9 loads and 5 stores on APB2, no loop longer than four, no division.

namespace kmax::drivers::stm32f4 {

/// Which channels are where, and how long they are sampled.
struct CurrentSamplingConfig {
  struct Phases {
    std::uint8_t b;  // converted by ADC2
    std::uint8_t c;  // converted by ADC3
  };
  std::array<Phases, 2> axes;
  std::uint8_t supply;
  std::array<std::uint8_t, 2> temperatures;  // power stages of the axes
  std::uint8_t current_sampling_code;        // index into adc_sampling_cycles
  std::uint8_t slow_sampling_code;           // likewise, of supply and temperatures
};

/// Codes are 0 to 4095, 3.3 V full scale; words, as the registers are, which a tick need not cut.
struct CurrentSample {
  bool valid = false;  ///< phase_b and phase_c are of the axis asked for, and of one trigger
  std::uint32_t phase_b = 0;
  std::uint32_t phase_c = 0;
  std::uint32_t supply = 0;
  /// Reads since ADC1 finished a sequence: 0 normally, 1 after a late interrupt, more means that ADC1 stands
  /// still and the slow codes are old. Stays at 255.
  std::uint8_t slow_age = 0;
};

/// Codes of an axis' amplifiers while no current passes their shunts.
struct ZeroCurrentCodes {
  std::uint32_t phase_b = 0, phase_c = 0;  ///< words, as the registers are: stored by one instruction
};

struct CurrentSamplingCounters {
  std::uint32_t axis_mismatches = 0;
  std::uint32_t overruns = 0;
  std::uint32_t missing_phase_c = 0;
  std::uint32_t spurious = 0;
};

template <typename Adc = AdcRegisters, typename Common = AdcCommonRegisters>
class CurrentSampling {
 public:
  constexpr CurrentSampling(Adc& adc1, Adc& adc2, Adc& adc3, Common& common,
                            const CurrentSamplingConfig& config)
      : adc1_(adc1), adc2_(adc2), adc3_(adc3), common_(common), config_(config) {
    const auto &first = config.axes[0], &second = config.axes[1];
    lists_ = {{{pair_of(first.b, second.b), pair_of(first.c, second.c)},
               {pair_of(second.b, first.b), pair_of(second.c, first.c)}}};
  }

  /// Turns the converters on with their triggers off. False, and nothing touched, when the ADC clock would be
  /// above 36 MHz, a channel cannot be reached by its converter or a sampling code is above 7.
  [[nodiscard]] bool configure(std::uint32_t apb2_hz) {
    if (apb2_hz > prescaler * adc_maximum_clock_hz || !channels_reachable()) return false;
    stop();
    common_.ccr = adc_ccr::Prescaler::bits(prescaler / 2 - 1);
    adc1_.cr1 = adc_cr1::Scan::mask;
    adc2_.cr1 = adc_cr1::Scan::mask | adc_cr1::InjectedEndInterrupt::mask;
    adc3_.cr1 = adc_cr1::Scan::mask;
    const auto slow = slow_channels();
    set_sampling_times(adc1_, slow, config_.slow_sampling_code);
    set_sampling_times(adc2_, std::array{config_.axes[0].b, config_.axes[1].b},
                       config_.current_sampling_code);
    set_sampling_times(adc3_, std::array{config_.axes[0].c, config_.axes[1].c},
                       config_.current_sampling_code);
    adc1_.jsqr = list_of<3>(slow);
    for (Adc* each : {&adc1_, &adc2_, &adc3_}) each->cr2 = adc_cr2::On::mask;
    return true;
  }

  /// The next trigger converts the currents of `first_axis` (0 or 1). Not sooner than adc_stabilization_us
  /// after `configure`. ADC2 comes last: its interrupt means that all three were listening.
  void start(unsigned first_axis) {
    arm_lists(first_axis & 1U);
    last_axis_ = none;
    supply_ = 0;
    slow_age_ = 0;
    for (Adc* each : {&adc1_, &adc3_, &adc2_}) {
      each->sr = flags_cleared;
      each->cr2 = adc_cr2::On::mask | adc_cr2::InjectedTrigger::bits(adc_cr2::timer1_trgo) |
                  adc_cr2::InjectedTriggerEdge::bits(adc_cr2::rising);
    }
  }

  /// No further trigger is heeded; a conversion under way still ends and interrupts.
  void stop() {
    for (Adc* each : {&adc2_, &adc3_, &adc1_}) {
      each->cr2 = static_cast<std::uint32_t>(each->cr2) & ~adc_cr2::InjectedTriggerEdge::mask;
    }
  }

  /// The body of the ADC interrupt. `axis` (0 or 1) is the one whose sampling point the latest trigger was,
  /// by the timer's own direction bit and not by counting interrupts. By value: a tick takes it from
  /// registers.
  [[gnu::always_inline]] CurrentSample ISR_read(unsigned axis) {
    axis &= 1U;
    CurrentSample sample;
    if (!finished(adc2_)) [[unlikely]] {
      ++counters_.spurious;
      sample.supply = supply_;
      sample.slow_age = slow_age_;
      return sample;
    }
    const std::uint32_t phase_c_flags = word(adc3_.sr);
    // Before the data is read: a conversion that ends from here on shows in the flags again.
    adc2_.sr = flags_cleared;
    adc3_.sr = flags_cleared;
    sample.phase_b = word(adc2_.jdr[0]);
    sample.phase_c = word(adc3_.jdr[0]);
    // Also of a trigger out of step, whose codes a current may have made: who follows them must be slow.
    zero_current_[axis ^ 1U] = {word(adc2_.jdr[1]), word(adc3_.jdr[1])};
    const unsigned converted_axis = axis_in_force_;
    arm_lists(axis ^ 1U);
    const std::uint32_t flags_since = word(adc2_.sr);
    sample.valid = (flags_since & started_or_ended) == 0 && converted_axis == axis &&
                   (phase_c_flags & adc_sr::InjectedEnd::mask) != 0;
    if (!sample.valid) [[unlikely]]
      reject(axis, converted_axis, phase_c_flags, flags_since);
    last_axis_ = axis;
    sample.slow_age = read_slow();
    sample.supply = supply_;
    return sample;
  }

  /// Of the last trigger, 0 before the first; written by the interrupt, for other contexts.
  std::uint32_t supply() const { return supply_; }
  /// Of an axis' power stage, converted last. Any context; not the interrupt's business.
  std::uint16_t temperature(unsigned axis) const {
    return static_cast<std::uint16_t>(word(adc1_.jdr[1 + axis]));
  }
  /// Written by the interrupt. Zeros before the other axis' first read.
  const ZeroCurrentCodes& zero_current(unsigned axis) const { return zero_current_[axis]; }
  /// Written by the interrupt; each is a word that another context may read.
  const CurrentSamplingCounters& counters() const { return counters_; }

 private:
  struct Lists {
    std::uint32_t adc2 = 0;
    std::uint32_t adc3 = 0;
  };
  static constexpr std::uint32_t prescaler = 4;
  static constexpr unsigned none = 2;
  static constexpr std::uint32_t started_or_ended = adc_sr::InjectedStarted::mask | adc_sr::InjectedEnd::mask;
  /// Writing 0 clears, 1 leaves alone.
  static constexpr std::uint32_t flags_cleared = adc_sr::all & ~started_or_ended;

  template <unsigned count>
  static constexpr std::uint32_t list_of(const std::array<std::uint8_t, count>& channels) {
    std::uint32_t word = adc_jsqr::LastIndex::bits(count - 1);
    for (unsigned i = 0; i < count; ++i) {
      word |= (channels[i] & adc_jsqr::channel_mask) << adc_jsqr::position(i, count);
    }
    return word;
  }

  static constexpr std::uint32_t pair_of(std::uint32_t first, std::uint32_t second) {
    return adc_jsqr::LastIndex::bits(1) | first << adc_jsqr::position(0, 2) |
           second << adc_jsqr::position(1, 2);
  }

  /// As ADC1 converts them.
  std::array<std::uint8_t, 3> slow_channels() const {
    return {config_.supply, config_.temperatures[0], config_.temperatures[1]};
  }

  bool channels_reachable() const {
    bool all = config_.current_sampling_code < 8 && config_.slow_sampling_code < 8;
    for (const auto& axis : config_.axes) all = all && adc_reaches(2, axis.b) && adc_reaches(3, axis.c);
    for (const std::uint8_t channel : slow_channels()) all = all && adc_reaches(1, channel);
    return all;
  }

  template <std::size_t count>
  static void set_sampling_times(Adc& adc, const std::array<std::uint8_t, count>& channels,
                                 std::uint32_t sampling) {
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    for (const std::uint8_t channel : channels) {
      const std::uint32_t shifted = sampling << adc_sampling_position(channel);
      (adc_sampling_in_smpr1(channel) ? high : low) |= shifted;
    }
    adc.smpr1 = high;
    adc.smpr2 = low;
  }

  static bool finished(const Adc& adc) { return adc_sr::InjectedEnd::read(adc.sr) != 0; }
  static std::uint32_t word(const Register auto& data) { return static_cast<std::uint32_t>(data); }

  void arm_lists(unsigned axis) {
    adc2_.jsqr = lists_[axis].adc2;
    adc3_.jsqr = lists_[axis].adc3;
    axis_in_force_ = axis;
  }

  /// Of a sample that is not valid: counts why, and what the next one is to be believed. Two triggers of one
  /// axis in a row are a mismatch as well, since the lists change at each read.
  [[gnu::noinline, gnu::cold]] void reject(unsigned axis, unsigned converted_axis,
                                           std::uint32_t phase_c_flags, std::uint32_t flags_since) {
    const bool disturbed = (flags_since & started_or_ended) != 0;
    // That trigger may have come before or after its list was written: its sample belongs to nobody.
    if (disturbed) axis_in_force_ = none;
    if (disturbed || axis == last_axis_) ++counters_.overruns;
    if (converted_axis != axis) ++counters_.axis_mismatches;
    if ((phase_c_flags & adc_sr::InjectedEnd::mask) == 0) ++counters_.missing_phase_c;
  }

  /// Their age.
  std::uint8_t read_slow() {
    if (!finished(adc1_)) [[unlikely]] {
      if (slow_age_ != 0xFF) ++slow_age_;
      return slow_age_;
    }
    adc1_.sr = flags_cleared;
    supply_ = word(adc1_.jdr[0]);
    slow_age_ = 0;
    return 0;
  }

  Adc& adc1_;
  Adc& adc2_;
  Adc& adc3_;
  Common& common_;
  CurrentSamplingConfig config_;
  std::array<Lists, 2> lists_{};
  unsigned axis_in_force_ = none;
  unsigned last_axis_ = none;
  std::uint32_t supply_ = 0;
  std::uint8_t slow_age_ = 0;
  std::array<ZeroCurrentCodes, 2> zero_current_{};
  CurrentSamplingCounters counters_{};
};

}  // namespace kmax::drivers::stm32f4
