// The registers of GeneralTimerModel as the bus sees them.

#include <cstddef>
#include <string>

#include "drivers/stm32f4/registers/timer.hpp"
#include "host_tools/virtual_board/stm32f4/general_timer.hpp"

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::TimerRegisters;
namespace timer_ccer = drivers::stm32f4::timer_ccer;
namespace timer_ccmr = drivers::stm32f4::timer_ccmr;
namespace timer_cr1 = drivers::stm32f4::timer_cr1;
namespace timer_dier = drivers::stm32f4::timer_dier;
namespace timer_egr = drivers::stm32f4::timer_egr;
namespace timer_smcr = drivers::stm32f4::timer_smcr;

constexpr unsigned channels = 4;
constexpr std::uint32_t cr1_known = timer_cr1::Enable::mask | timer_cr1::UpdateRequestSource::mask |
                                    timer_cr1::CountingDown::mask | timer_cr1::AutoReloadPreload::mask |
                                    timer_cr1::ClockDivision::mask;
constexpr std::uint32_t cr1_of_counter = timer_cr1::Enable::mask | timer_cr1::CountingDown::mask;
constexpr std::uint32_t dier_known =
    timer_dier::UpdateInterrupt::mask | timer_dier::CaptureCompareInterrupt<1>::mask |
    timer_dier::CaptureCompareInterrupt<2>::mask | timer_dier::CaptureCompareInterrupt<3>::mask |
    timer_dier::CaptureCompareInterrupt<4>::mask;
constexpr std::uint32_t input_fields = timer_ccmr::Selection<1>::mask | timer_ccmr::InputFilter<1>::mask;
constexpr std::uint32_t ccmr_known = input_fields | input_fields << timer_ccmr::bits_per_channel;
constexpr std::uint32_t channel_switches =
    timer_ccer::Enable<1>::mask | timer_ccer::Polarity<1>::mask | timer_ccer::ComplementaryPolarity<1>::mask;
constexpr std::uint32_t ccer_known = channel_switches | channel_switches << timer_ccer::bits_per_channel |
                                     channel_switches << 2 * timer_ccer::bits_per_channel |
                                     channel_switches << 3 * timer_ccer::bits_per_channel;

std::uint32_t mode_of(const std::array<std::uint32_t, 2>& ccmr, unsigned index) {
  return ccmr[index / 2] >> (timer_ccmr::bits_per_channel * (index % 2));
}

}  // namespace

std::uint32_t GeneralTimerModel::read(const Access& access) {
  require_word(access, name_);
  advance(access.now);
  switch (access.offset) {
    case offsetof(TimerRegisters, cr1):
      return cr1_ | timer_cr1::Enable::bits(running_ ? 1 : 0) | timer_cr1::CountingDown::bits(down_ ? 1 : 0);
    case offsetof(TimerRegisters, cr2):
      return 0;
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
      return count(access.now);
    case offsetof(TimerRegisters, psc):
      return psc_.preload;
    case offsetof(TimerRegisters, arr):
      return arr_.preload;
    case offsetof(TimerRegisters, ccr[0]):
      return read_capture(1);
    case offsetof(TimerRegisters, ccr[1]):
      return read_capture(2);
    case offsetof(TimerRegisters, ccr[2]):
      return read_capture(3);
    case offsetof(TimerRegisters, ccr[3]):
      return read_capture(4);
    default:
      refuse(access, name_, "register is not modelled");
  }
}

void GeneralTimerModel::write(const Access& access, std::uint32_t value) {
  require_word(access, name_);
  advance(access.now);
  switch (access.offset) {
    case offsetof(TimerRegisters, cr1):
      write_cr1(access, value);
      break;
    case offsetof(TimerRegisters, cr2):
      require_known(access, value, 0, "CR2");
      break;
    case offsetof(TimerRegisters, smcr):
      write_smcr(access, value);
      break;
    case offsetof(TimerRegisters, dier):
      require_known(access, value, dier_known, "DIER");
      dier_ = value;
      update_interrupt();
      break;
    case offsetof(TimerRegisters, sr):
      sr_ &= value;
      update_interrupt();
      break;
    case offsetof(TimerRegisters, egr):
      require_known(access, value, timer_egr::Update::mask, "EGR");
      if (value != 0) software_update(access.now);
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
      if (value > arr_.active) {
        refuse(access, name_,
               "CNT = " + std::to_string(value) + " is above ARR = " + std::to_string(arr_.active));
      }
      count_from(access.now, value);
      break;
    case offsetof(TimerRegisters, psc):
      require_known(access, value, 0xFFFF, "PSC");
      psc_.preload = value;
      break;
    case offsetof(TimerRegisters, arr):
      write_arr(access, value);
      break;
    case offsetof(TimerRegisters, ccr[0]):
    case offsetof(TimerRegisters, ccr[1]):
    case offsetof(TimerRegisters, ccr[2]):
    case offsetof(TimerRegisters, ccr[3]):
      if (value != 0)
        refuse(access, name_, "compare channels are not modelled; CCRx of a capture is read-only");
      break;
    default:
      refuse(access, name_, "register is not modelled");
  }
}

void GeneralTimerModel::require_known(const Access& access, std::uint32_t value, std::uint32_t known,
                                      const char* name) const {
  if ((value & ~known) == 0) return;
  refuse(access, name_,
         std::string(name) + " is written " + std::to_string(value) + "; the bits in " +
             std::to_string(value & ~known) + " are not modelled, those in " + std::to_string(known) +
             " are");
}

void GeneralTimerModel::write_cr1(const Access& access, std::uint32_t value) {
  require_known(access, value, cr1_known, "CR1");
  if (timer_cr1::ClockDivision::of(value) == 3) refuse(access, name_, "CKD = 3 is reserved");
  // In encoder mode DIR is the hardware's.
  if (!encoder_mode()) down_ = timer_cr1::CountingDown::of(value) != 0;
  const bool enable = timer_cr1::Enable::of(value) != 0;
  const bool was_preloaded = timer_cr1::AutoReloadPreload::of(cr1_) != 0;
  cr1_ = value & ~cr1_of_counter;
  if (was_preloaded && timer_cr1::AutoReloadPreload::of(cr1_) == 0 && arr_.active != arr_.preload) {
    refuse(access, name_, "ARPE is cleared while a new ARR waits for the update event");
  }
  if (enable == running_) {
    if (running_ && down_ && !encoder_mode())
      refuse(access, name_, "down-counting (DIR = 1) is not modelled");
    return;
  }
  if (!enable) return stop(access.now);
  if (arr_.active == 0) refuse(access, name_, "the counter is started with ARR = 0, which blocks it");
  if (count_ > arr_.active) {
    refuse(access, name_,
           "the counter is started at " + std::to_string(count_) +
               ", above ARR = " + std::to_string(arr_.active));
  }
  if (encoder_mode()) {
    require_encoder_inputs(access);
  } else if (down_) {
    refuse(access, name_, "down-counting (DIR = 1) is not modelled");
  }
  start(access.now);
}

/// Section Encoder interface mode: both inputs on their own pins. The polarity "both edges" must not be used.
void GeneralTimerModel::require_encoder_inputs(const Access& access) const {
  if (psc_.active != 0) refuse(access, name_, "encoder mode with a prescaler (PSC) is not modelled");
  for (unsigned index = 0; index < 2; ++index) {
    const std::uint32_t polarity = ccer_ >> (timer_ccer::bits_per_channel * index);
    if (timer_ccmr::Selection<1>::of(mode_of(ccmr_, index)) != timer_ccmr::input_of_own_pin ||
        timer_ccer::ComplementaryPolarity<1>::of(polarity) != 0) {
      refuse(access, name_,
             "encoder mode needs CC" + std::to_string(index + 1) + "S = 1 and CC" +
                 std::to_string(index + 1) + "NP = 0");
    }
  }
}

void GeneralTimerModel::write_smcr(const Access& access, std::uint32_t value) {
  const std::uint32_t mode = timer_smcr::SlaveMode::of(value);
  require_known(access, value, timer_smcr::SlaveMode::mask, "SMCR");
  if (mode != timer_smcr::slave_off && mode != timer_smcr::slave_encoder_both_inputs) {
    refuse(access, name_, "SMS = " + std::to_string(mode) + " is not modelled; 0 and 3 (encoder) are");
  }
  if (value != smcr_ && running_) refuse(access, name_, "SMS is changed while the counter runs");
  smcr_ = value;
}

void GeneralTimerModel::write_ccmr(const Access& access, unsigned index, std::uint32_t value) {
  require_known(access, value, ccmr_known, index == 0 ? "CCMR1" : "CCMR2");
  for (unsigned channel = 2 * index; channel < 2 * index + 2; ++channel) {
    const unsigned shift = timer_ccmr::bits_per_channel * (channel % 2);
    const std::uint32_t selection = timer_ccmr::Selection<1>::of(value >> shift);
    if (selection > timer_ccmr::input_of_own_pin) {
      refuse(access, name_, "CCxS = " + std::to_string(selection) + " is not modelled; 1 (own pin) is");
    }
    if (selection == 0 && timer_ccmr::InputFilter<1>::of(value >> shift) != 0) {
      refuse(access, name_, "compare outputs (CCxS = 0 with OCxM) are not modelled");
    }
    const bool on = timer_ccer::Enable<1>::of(ccer_ >> (timer_ccer::bits_per_channel * channel)) != 0;
    if (on && selection != timer_ccmr::Selection<1>::of(ccmr_[index] >> shift)) {
      refuse(access, name_, "CCxS is writable only while its channel is off (CCxE = 0)");
    }
  }
  if (running_ && encoder_mode() && index == 0 && value != ccmr_[0]) {
    refuse(access, name_, "CCMR1 is changed while the encoder is being counted");
  }
  ccmr_[index] = value;
}

void GeneralTimerModel::write_ccer(const Access& access, std::uint32_t value) {
  require_known(access, value, ccer_known, "CCER");
  for (unsigned index = 0; index < channels; ++index) {
    const std::uint32_t channel = value >> (timer_ccer::bits_per_channel * index);
    if (timer_ccer::Enable<1>::of(channel) != 0 && timer_ccmr::Selection<1>::of(mode_of(ccmr_, index)) == 0) {
      refuse(access, name_,
             "CC" + std::to_string(index + 1) + "E enables a compare output, which is not modelled");
    }
    if (timer_ccer::ComplementaryPolarity<1>::of(channel) != 0 && timer_ccer::Polarity<1>::of(channel) == 0) {
      refuse(access, name_, "CCxNP = 1 with CCxP = 0 is reserved for an input");
    }
  }
  ccer_ = value;
  if (running_ && encoder_mode()) require_encoder_inputs(access);
}

void GeneralTimerModel::write_arr(const Access& access, std::uint32_t value) {
  require_known(access, value, longest_, "ARR");
  if (timer_cr1::AutoReloadPreload::of(cr1_) == 0) {
    if (running_ && (value == 0 || value < count(access.now))) {
      refuse(access, name_,
             "ARR = " + std::to_string(value) + " is written without preload below the running count");
    }
    const std::uint32_t present = count(access.now);
    const BoardTime since_tick = running_ && !encoder_mode() ? (access.now - origin_) % tick_ : 0;
    arr_.active = value;
    if (running_) count_from(access.now - since_tick, present);
  } else if (value == 0) {
    refuse(access, name_, "ARR = 0 blocks the counter; 1 and above are allowed");
  }
  arr_.preload = value;
}

std::uint32_t GeneralTimerModel::read_capture(unsigned channel) {
  if (captures(channel)) {
    sr_ &= ~(drivers::stm32f4::timer_sr::CaptureCompare<1>::mask << (channel - 1));
    update_interrupt();
  }
  return captured_[channel - 1];
}

}  // namespace kmax::virtual_board
