#pragma once

#include "board/odrive_v3/description.hpp"
#include "drivers/stm32f4/three_phase_pwm.hpp"
#include "host_tools/simulation/inverter.hpp"

namespace kmax::simulated_board {

/// A bridge of the board: its PWM driver on a timer that is memory, and what that timer's outputs are.
///
/// Duties have the driver's rounding, limits and dead time. They are preloaded: update() is the timer's
/// update event, half a period after the sample. Arming and disarming act at once, as MOE does.
class SimulatedBridge {
 public:
  SimulatedBridge() {
    // Memory has neither locks nor faults.
    static_cast<void>(pwm_.configure());
    pwm_.enable_counter();
    pwm_.ISR_set_no_voltage();
    update();
  }
  SimulatedBridge(const SimulatedBridge&) = delete;
  SimulatedBridge& operator=(const SimulatedBridge&) = delete;

  drivers::stm32f4::ThreePhasePwm<>& pwm() { return pwm_; }

  void update() {
    for (std::size_t leg = 0; leg < active_.size(); ++leg) active_[leg] = registers_.ccr[leg];
  }

  /// What the legs do now.
  simulation::InverterCommand command() const {
    namespace ccer = drivers::stm32f4::timer_ccer;
    const std::array<std::uint32_t, 3> outputs{ccer::Enable<1>::mask, ccer::Enable<2>::mask,
                                               ccer::Enable<3>::mask};
    simulation::InverterCommand command;
    const double period = pwm_.half_period_ticks();
    for (std::size_t leg = 0; leg < active_.size(); ++leg) {
      command.legs[leg] = {pwm_.armed() && (registers_.ccer & outputs[leg]) != 0,
                           (period - static_cast<double>(active_[leg])) / period};
    }
    command.dead_time = board::odrive_v3::description.dead_time();
    command.pwm_frequency = board::odrive_v3::description.pwm_hz();
    return command;
  }

 private:
  drivers::stm32f4::TimerRegisters registers_{};
  drivers::stm32f4::ThreePhasePwm<> pwm_{registers_, board::odrive_v3::pwm_config};
  std::array<std::uint32_t, 3> active_{};
};

}  // namespace kmax::simulated_board
