#pragma once

#include "drivers/stm32f4/registers/timer.hpp"
#include "drivers/stm32f4/three_phase_pwm.hpp"

// Two PWM timers half a period apart, so that one trigger serves the currents of both axes in turn:
//
//   TIM1  underflow ............ overflow ............. underflow      TRGO = update event: at each of them
//   TIM8  overflow ............. underflow ............ overflow
//         currents of axis 0     currents of axis 1     axis 0 ...
//
// The shift comes from the start values: TIM1 starts at 0 upwards, TIM8 at ARR downwards. Both must have the
// same ARR.
//
// The start in step is done by hardware: TIM1 shows its CEN on TRGO (MMS = 1), which is ITR0 of TIM8, and
// TIM8 waits in trigger mode. TIM8 then lags by the synchronisation of that input, a constant tick or two (12
// ns) that neither interrupts nor wait states nor the compiler can change, which two stores in a row to CEN
// would allow. Once running, TIM8 ignores triggers and TIM1's TRGO becomes the update event (MMS = 2) for the
// ADC.
//
// The rising edge of TRGO at the start also triggers an ADC that is already listening: it is a sample of axis
// 0 with the outputs off. An ADC that is to miss nothing else is started before; one that is to see update
// events only, after.
//
// Contexts: start-up, before the sampling interrupt is enabled. Takes under 1 us, so MMS = 2 is set long
// before the first overflow, 25 us after the start.

namespace kmax::drivers::stm32f4 {

/// `leader` is on TIM1, `follower` on TIM8, both configured. Outputs stay off. False when their periods
/// differ or the hardware does not follow; both counters are stopped then. Stops and restarts counters that
/// run.
template <typename LeaderRegisters, typename FollowerRegisters>
[[nodiscard]] bool start_phase_shifted(ThreePhasePwm<LeaderRegisters>& leader,
                                       ThreePhasePwm<FollowerRegisters>& follower) {
  leader.disarm();
  follower.disarm();
  leader.stop();
  follower.stop();
  if (leader.half_period_ticks() != follower.half_period_ticks()) return false;

  leader.select_trigger_output(timer_cr2::master_enable);
  leader.load_counter(false);
  follower.load_counter(true);
  const bool loaded = !leader.counting_down() && leader.counter() == 0 && follower.counting_down() &&
                      follower.counter() == follower.half_period_ticks();
  if (!loaded) return false;

  follower.start_on_internal_trigger_0();
  leader.enable_counter();
  bool follows = false;
  for (unsigned polls = 0; polls < 16 && !follows; ++polls) follows = follower.running();
  follower.ignore_triggers();
  leader.select_trigger_output(timer_cr2::master_update);
  if (!follows) {
    leader.stop();
    follower.stop();
  }
  return follows;
}

}  // namespace kmax::drivers::stm32f4
