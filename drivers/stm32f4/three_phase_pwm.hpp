#pragma once

#include <algorithm>
#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/stm32f4/dead_time.hpp"
#include "drivers/stm32f4/registers/timer.hpp"

// Centre-aligned complementary PWM for three half-bridges on TIM1 or TIM8. RM0090, Advanced-control timers.
//
// The counter runs 0, 1, ... ARR, ... 1, 0: a period is 2 * ARR ticks, as 168 MHz / 8400 = 20 kHz.
// PWM mode 2 turns the high side on while the counter is above CCR, which gives a duty of exactly (ARR - CCR)
// / ARR and centres the low-side window, 2 * CCR ticks, on the underflow. The shunts lie below the low sides,
// so the underflow is where currents are sampled. `minimum_low_ticks` keeps CCR from falling below the time
// that recharges the bootstrap, and from the low side's command to a settled amplifier of the lowest gain; of
// a higher one it is the caller who leaves more. 252 of 4200 ticks are 1.5 us: greatest duty 0.94.
//
// Registers are preloaded: a duty becomes active at the next over- or underflow (RCR = 0), at most half a
// period later, all three legs together. Three stores are not one: a call that straddles that instant gives
// the legs duties of two calls for half a period. The sampling interrupt that calls it 1 us after the update
// event is clear of it by 24 us.
//
// What switches off:
//   * MOE is the one switch. With OSSI = OSSR = 1 and all idle levels 0, MOE = 0 drives both gate signals of
//     every enabled leg low, at once and also without a clock. AOE = 0: nothing but `arm` sets MOE.
//   * `disarm` is one store of a constant to BDTR: no read, so it may interrupt or be interrupted by
//     anything. `arm` is one store as well. Whoever arms looks at his fault latch again after `arm`, because
//     a `disarm` from an interrupt just before the store is undone by it.
//   * A failing crystal: the clock security system's break (BKE = 1) clears MOE in hardware.
//   * BKP = 1 (break when high). No pin is mapped to BKIN here, and an alternate-function input without a pin
//     is taken to read low. The manual does not say so: where it reads high, `break_is_held` says so, and
//     `break_when_low` turns BKP round, after a reset of the timer, since LOCK has frozen it.
//   * LOCK level 2 freezes dead time, idle levels, polarities and break set-up until reset, so that a stray
//     store cannot short a leg. `configure` may be repeated with the same dead time only, else it fails.
//     Level 3 would lock the PWM mode too, but then a `disarm` before `configure` would prevent it.
//
// A leg that is not enabled (CCxE = CCxNE = 0) is released by the timer, whatever OSSR says: its gate pins
// need pull-downs (configure them as alternate function with GpioPull::down). A brushed motor uses legs B and
// C, those with shunts, and leaves A off.
//
// Cost: `ISR_set_duty` 40 instructions without a call, `disarm` one store.

namespace kmax::drivers::stm32f4 {

struct PwmLegs {
  bool a = true;
  bool b = true;
  bool c = true;
  friend constexpr bool operator==(const PwmLegs&, const PwmLegs&) = default;
};

struct ThreePhasePwmConfig {
  std::uint16_t half_period_ticks;  // ARR
  std::uint8_t dead_time_code;      // dead_time.hpp
  std::uint16_t minimum_low_ticks;  // above the dead time, below half_period_ticks
};

/// Share of the period in which the high side is on, 0 to 1.
struct PhaseDuty {
  float a, b, c;
};
/// The same in ticks of half a period, 0 to half_period_ticks.
struct PhaseTicks {
  std::uint16_t a, b, c;
};

template <typename Registers = TimerRegisters>
class ThreePhasePwm {
 public:
  explicit constexpr ThreePhasePwm(Registers& registers, const ThreePhasePwmConfig& config)
      : registers_(registers),
        config_(config),
        disarmed_(bdtr_without_main_output(config.dead_time_code)),
        ticks_per_duty_(static_cast<float>(config.half_period_ticks)),
        fewest_compare_(config.minimum_low_ticks) {}

  /// Sets everything up with the counter stopped, the outputs off and duty 0. False when the configuration is
  /// not possible or BDTR was locked with other contents; the outputs are off then too. The counter starts
  /// with `start_phase_shifted` (phase_shifted_pwm.hpp).
  [[nodiscard]] bool configure() {
    disarm();
    if (config_.minimum_low_ticks >= config_.half_period_ticks ||
        config_.minimum_low_ticks <= dead_time_ticks(config_.dead_time_code) || config_.dead_time_code == 0) {
      return false;
    }
    stop();
    registers_.smcr = 0;
    registers_.dier = 0;
    registers_.ccr[3] = 0xFFFF;  // the comparison of TickWatch: out of reach
    // Idle levels 0. TRGO shows CEN, so that the UG below triggers nobody; with MMS = 0 it would.
    registers_.cr2 = timer_cr2::MasterMode::bits(timer_cr2::master_enable);
    registers_.ccer = 0;
    registers_.ccmr[0] = compare<1>() | compare<2>();
    registers_.ccmr[1] = compare<3>();
    registers_.psc = 0;
    registers_.rcr = 0;
    registers_.arr = config_.half_period_ticks;
    for (unsigned leg = 0; leg < 3; ++leg) registers_.ccr[leg] = config_.half_period_ticks;
    load_counter(false);
    registers_.sr = 0;
    static_cast<void>(enable_legs({}));
    return static_cast<std::uint32_t>(registers_.bdtr) == disarmed_;
  }

  /// Turns both FETs of every leg off. Any context.
  void disarm() { registers_.bdtr = disarmed_; }

  /// Gives the gate signals to the PWM. False when the counter does not run, or the hardware holds MOE at 0.
  [[nodiscard]] bool arm() {
    if (!running()) return false;
    registers_.sr = ~timer_sr::CaptureCompare<4>::mask;
    registers_.bdtr = disarmed_ | timer_bdtr::MainOutputEnable::mask;
    // The write acts on the asynchronous bit, the read sees the synchronised one (RM0090, Using the break
    // function).
    cortex_m::data_synchronization_barrier();
    return armed();
  }

  bool armed() const { return timer_bdtr::MainOutputEnable::read(registers_.bdtr) != 0; }
  /// Since `arm`: it was TickWatch that took MOE away.
  bool ISR_ticks_stayed_away() const { return timer_sr::CaptureCompare<4>::read(registers_.sr) != 0; }

  /// Which legs follow the PWM; the others are released. False, and nothing changed, while armed.
  [[nodiscard]] bool enable_legs(PwmLegs legs) {
    if (armed()) return false;
    registers_.ccer = (legs.a ? outputs<1>() : 0) | (legs.b ? outputs<2>() : 0) | (legs.c ? outputs<3>() : 0);
    return true;
  }

  /// Active from the next over- or underflow. Values outside 0 to what leaves the low-side window, as a share
  /// of the half period, are limited. False, and nothing written, when one is not a number: the caller
  /// disarms.
  [[nodiscard]] bool ISR_set_duty(const PhaseDuty& duty) {
    // One comparison for all: what is not a number, and what would not fit an integer.
    const float sum = magnitude(duty.a) + magnitude(duty.b) + magnitude(duty.c);
    if (!(sum < convertible)) [[unlikely]]
      return set_far_duty(duty.a, duty.b, duty.c);
    // Taken here: the compiler would load them again after each store to a register.
    const std::int32_t whole = config_.half_period_ticks, fewest = fewest_compare_;
    const std::int32_t a = whole - high_ticks(duty.a), b = whole - high_ticks(duty.b),
                       c = whole - high_ticks(duty.c);
    // Below the fewest is far above everything without a sign: one comparison for both ends.
    const auto range = static_cast<std::uint32_t>(whole - fewest);
    const auto is_beyond = [fewest, range](std::int32_t compare) {
      return static_cast<std::uint32_t>(compare - fewest) > range;
    };
    if (is_beyond(a) || is_beyond(b) || is_beyond(c)) [[unlikely]]
      return set_far_duty(duty.a, duty.b, duty.c);
    registers_.ccr[0] = static_cast<std::uint32_t>(a);
    registers_.ccr[1] = static_cast<std::uint32_t>(b);
    registers_.ccr[2] = static_cast<std::uint32_t>(c);
    return true;
  }

  /// All legs alike, in the middle: no voltage between them.
  void ISR_set_no_voltage() {
    const auto middle = static_cast<std::uint16_t>(config_.half_period_ticks / 2);
    ISR_set_ticks({middle, middle, middle});
  }

  /// Values that would close the low-side window are limited.
  void ISR_set_ticks(const PhaseTicks& high) {
    registers_.ccr[0] = compare_of(high.a);
    registers_.ccr[1] = compare_of(high.b);
    registers_.ccr[2] = compare_of(high.c);
  }

  constexpr std::uint16_t half_period_ticks() const { return config_.half_period_ticks; }

  /// False from underflow to overflow. The interrupt that follows a conversion 1 us after an update event
  /// reads it: false means the event was this timer's underflow. It stays right for 24 us.
  bool counting_down() const { return timer_cr1::CountingDown::read(registers_.cr1) != 0; }
  /// After `configure`: the break input keeps MOE at 0, and `arm` would fail for ever.
  bool break_is_held() {
    registers_.sr = ~timer_sr::Break::mask;
    cortex_m::data_synchronization_barrier();
    return timer_sr::Break::read(registers_.sr) != 0;
  }
  /// Before `configure`, the timer fresh from its reset.
  void break_when_low() { disarmed_ &= ~timer_bdtr::BreakActiveHigh::mask; }

  bool running() const { return timer_cr1::Enable::read(registers_.cr1) != 0; }

  // The steps of start_phase_shifted(); nobody else needs them.

  /// Stops the counter. Three writes: direction, alignment and enable must not change together.
  void stop() {
    timer_cr1::Enable::clear(registers_.cr1);
    timer_cr1::Alignment::clear(registers_.cr1);
    registers_.cr1 = loading;
  }

  /// At 0 counting up or at ARR counting down, preloaded registers active, stopped. The direction is writable
  /// only while edge-aligned, and centre-aligned counting starts in the direction it finds (RM0090, Hints on
  /// using center-aligned mode); UG loads ARR when that is down.
  void load_counter(bool down) {
    stop();
    registers_.cr1 = loading | timer_cr1::CountingDown::bits(down ? 1 : 0);
    registers_.egr = timer_egr::Update::mask;
    // Counted both ways, for the comparison of TickWatch.
    timer_cr1::Alignment::write(registers_.cr1, 3);
  }
  void enable_counter() { timer_cr1::Enable::set(registers_.cr1); }
  void select_trigger_output(std::uint32_t mode) { timer_cr2::MasterMode::write(registers_.cr2, mode); }
  void start_on_internal_trigger_0() {
    registers_.smcr = timer_smcr::TriggerSelection::bits(timer_smcr::internal_trigger_0);
    timer_smcr::SlaveMode::write(registers_.smcr, timer_smcr::slave_trigger);
  }
  void ignore_triggers() {
    timer_smcr::SlaveMode::write(registers_.smcr, timer_smcr::slave_off);
    registers_.sr = ~timer_sr::Trigger::mask;
  }
  std::uint32_t counter() const { return static_cast<std::uint32_t>(registers_.cnt); }

 private:
  /// UG must not raise the update interrupt.
  static constexpr std::uint32_t loading =
      timer_cr1::UpdateRequestSource::mask | timer_cr1::AutoReloadPreload::mask;

  static constexpr std::uint32_t bdtr_without_main_output(std::uint8_t dead_time) {
    return timer_bdtr::DeadTime::bits(dead_time) | timer_bdtr::Lock::bits(2) |
           timer_bdtr::IdleOffState::mask | timer_bdtr::RunOffState::mask | timer_bdtr::BreakEnable::mask |
           timer_bdtr::BreakActiveHigh::mask;
  }

  template <unsigned channel>
  static constexpr std::uint32_t compare() {
    return timer_ccmr::CompareMode<channel>::bits(timer_ccmr::pwm_mode_2) |
           timer_ccmr::ComparePreload<channel>::mask;
  }
  template <unsigned channel>
  static constexpr std::uint32_t outputs() {
    return timer_ccer::Enable<channel>::mask | timer_ccer::ComplementaryEnable<channel>::mask;
  }

  static constexpr float convertible = 1000.0F;
  /// One instruction, where the comparison with 0 takes four.
  static constexpr float magnitude(float value) { return __builtin_fabsf(value); }

  std::int32_t high_ticks(float duty) const {
    return static_cast<std::int32_t>(duty * ticks_per_duty_ + 0.5F);
  }

  [[gnu::noinline]] bool set_far_duty(float a, float b, float c) {
    if (a != a || b != b || c != c) return false;
    ISR_set_ticks({ticks_of(a), ticks_of(b), ticks_of(c)});
    return true;
  }

  /// Limit that keeps the low-side window open.
  constexpr std::uint16_t maximum_ticks() const {
    return static_cast<std::uint16_t>(config_.half_period_ticks - config_.minimum_low_ticks);
  }
  std::uint32_t compare_of(std::uint16_t high) const {
    return std::uint32_t{config_.half_period_ticks} - std::min(high, maximum_ticks());
  }
  std::uint16_t ticks_of(float duty) const {
    const float limited = std::clamp(duty, 0.0F, 1.0F);
    return static_cast<std::uint16_t>(limited * static_cast<float>(config_.half_period_ticks) + 0.5F);
  }

  Registers& registers_;
  ThreePhasePwmConfig config_;
  std::uint32_t disarmed_;
  // Of the configuration, as the tick needs them.
  float ticks_per_duty_;
  std::int32_t fewest_compare_;
};

}  // namespace kmax::drivers::stm32f4
