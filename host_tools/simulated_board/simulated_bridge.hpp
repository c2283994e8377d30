#pragma once

#include "drivers/stm32f4/three_phase_pwm.hpp"
#include "firmware/drive/motor_control.hpp"
#include "host_tools/simulation/inverter.hpp"

namespace kmax::simulated_board {

/// A bridge of the board: its PWM driver on a timer that is memory, and what that timer's outputs are.
///
/// Duties have the driver's rounding, limits and dead time. They are preloaded: update() is the timer's
/// update event, half a period after the sample. Arming and disarming act at once, as MOE does.
class SimulatedBridge {
 public:
  static constexpr double timer_clock_hz = 168e6;

  SimulatedBridge() : pwm_(registers_) {
    // Memory has neither locks nor faults.
    static_cast<void>(pwm_.configure());
    pwm_.enable_counter();
    set_no_voltage();
    update();
  }
  SimulatedBridge(const SimulatedBridge&) = delete;
  SimulatedBridge& operator=(const SimulatedBridge&) = delete;

  /// Without effect while armed, as on the board.
  void choose_legs(firmware::MotorKind kind) {
    const auto legs =
        kind == firmware::MotorKind::dc ? drivers::stm32f4::brushed_motor_legs : drivers::stm32f4::PwmLegs{};
    if (pwm_.enable_legs(legs)) legs_ = legs;
  }

  /// False: a duty is not a number, and nothing has changed.
  [[nodiscard]] bool set_duty(const firmware::MotorControl::Output& motor) {
    return pwm_.ISR_set_duty({motor.duty_a, motor.duty_b, motor.duty_c});
  }
  void set_no_voltage() {
    constexpr auto middle = drivers::stm32f4::ThreePhasePwmConfig{}.half_period_ticks / 2;
    pwm_.ISR_set_ticks({middle, middle, middle});
  }
  void arm() { static_cast<void>(pwm_.arm()); }
  void disarm() { pwm_.disarm(); }
  bool armed() const { return pwm_.armed(); }

  void update() {
    for (std::size_t leg = 0; leg < active_.size(); ++leg) active_[leg] = registers_.ccr[leg];
  }

  /// What the legs do now.
  simulation::InverterCommand command() const {
    const std::array<bool, 3> enabled{legs_.a, legs_.b, legs_.c};
    simulation::InverterCommand command;
    const double period = pwm_.half_period_ticks();
    for (std::size_t leg = 0; leg < active_.size(); ++leg)
      command.legs[leg] = {armed() && enabled[leg], (period - static_cast<double>(active_[leg])) / period};
    command.dead_time =
        drivers::stm32f4::dead_time_ticks(drivers::stm32f4::ThreePhasePwmConfig{}.dead_time_code) /
        timer_clock_hz;
    command.pwm_frequency = timer_clock_hz / (2.0 * period);
    return command;
  }

 private:
  drivers::stm32f4::TimerRegisters registers_{};
  drivers::stm32f4::ThreePhasePwm<> pwm_;
  drivers::stm32f4::PwmLegs legs_{};
  std::array<std::uint32_t, 3> active_{};
};

}  // namespace kmax::simulated_board
