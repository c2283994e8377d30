// A board that nobody sells: three brushed motors, a chip without relatives, its timers of 1,000 steps. All
// that it shares with a real one is what a board is made of: board/power and firmware.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "board/native/native_board.hpp"
#include "board/power/power.hpp"

namespace kmax::board {

static_assert(firmware::axis_count == 3);

class MadeUpBridge {
 public:
  struct Duty {
    float a, b, c;
  };
  struct Legs {
    bool a = true, b = true, c = true;
  };

  bool arm() { return armed_ = !held_off; }
  bool armed() const { return armed_; }
  void disarm() { armed_ = false; }
  bool ISR_set_duty(const Duty& duty) {
    if (!(std::abs(duty.a) + std::abs(duty.b) + std::abs(duty.c) < 10.0f)) return false;
    duty_ = duty;
    return true;
  }
  void ISR_set_no_voltage() { duty_ = {0.5f, 0.5f, 0.5f}; }
  void enable_legs(Legs legs) { legs_ = legs; }

  bool leg_a_enabled() const { return legs_.a; }
  /// Share of the supply between B and C, in whole steps of the timer.
  double voltage_share() const {
    const auto steps = [](float duty) {
      return std::round(std::clamp(static_cast<double>(duty), 0.0, 0.95) * 1000.0);
    };
    return armed_ ? (steps(duty_.b) - steps(duty_.c)) / 1000.0 : 0.0;
  }

  bool held_off = false;  ///< something keeps it from being armed

 private:
  Duty duty_{0.5f, 0.5f, 0.5f};
  Legs legs_{};
  bool armed_ = false;
};

/// Bridges, converters and encoders, with a motor of 1 ohm and 1 mH on each (board::MotorHardware).
class MadeUpHardware {
 public:
  static constexpr BoardDescription description{
      .name = "made_up",
      .core_clock_hz = 100'000'000,
      .timer_clock_hz = 40'000'000,
      .half_period_ticks = 1000,
      .dead_time_ticks = 5,
      .minimum_low_ticks = 50,
      .modulation_limit = {0.88f, 0.88f, 0.88f, 0.88f},
      .shunt = 0.5e-3,
      .thermistor = {.resistance_25_ohm = 10e3,
                     .beta_kelvin = 3434.0,
                     .ground_resistor_ohm = 3.3e3,
                     .open_below = 48,
                     .shorted_above = 3936},
      .gate_driver_supply_minimum = 0.0,
      .brake_pulse = 0.0,
  };
  static constexpr float supply_ratio = 10.0f;
  static constexpr double supply = 24.0;  ///< V

  struct Sample {
    bool valid = true;
    std::uint16_t phase_b = 2048, phase_c = 2048, supply = code_of(MadeUpHardware::supply / 10.0);
    std::uint8_t slow_age = 0;
  };

  static constexpr bool has(std::size_t) { return true; }
  MadeUpBridge& bridge(std::size_t axis) { return bridges_[axis]; }
  const Sample& ISR_sample(std::size_t axis) {
    const double codes_per_ampere = gain_ * description.shunt * 4096.0 / 3.3;
    const auto code = static_cast<int>(std::lround(currents[axis] * codes_per_ampere));
    samples_[axis].phase_b = static_cast<std::uint16_t>(2048 + code);
    samples_[axis].phase_c = static_cast<std::uint16_t>(2048 - code);
    return samples_[axis];
  }
  Sample zero_current(std::size_t) const { return {}; }
  std::uint16_t ISR_counter(std::size_t axis) const { return counters[axis]; }
  bool ISR_index_line(std::size_t) const { return false; }
  void set_brake(bool on) { brake_on = on; }

  std::uint16_t supply_code() const { return samples_[0].supply; }
  std::uint16_t temperature_code(std::size_t) const { return code_of(0.82); }  // about 30 degC
  std::uint32_t missed_ticks() const { return 0; }

  void set_gate_enable(bool) {}
  bool fault_line_low() const { return false; }
  bool emergency_stop_open() const { return false; }
  GateDriverAnswer configure_gate_driver(std::size_t, drivers::CurrentSenseGain gain) {
    gain_ = static_cast<double>(drivers::gain_factor(gain));
    return GateDriverAnswer::accepted;
  }
  std::uint16_t read_gate_driver_faults(std::size_t) const { return 0; }

  /// Lets the time pass, in s.
  void advance(double duration) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      const double voltage = supply * bridges_[axis].voltage_share() - 1.0 * currents[axis];
      currents[axis] = bridges_[axis].armed() ? currents[axis] + duration / 1e-3 * voltage : 0.0;
    }
  }

  std::array<std::uint16_t, firmware::axis_count> counters{};
  std::array<double, firmware::axis_count> currents{};  ///< A, out of B
  bool brake_on = false;

 private:
  static constexpr std::uint16_t code_of(double volts) {
    return static_cast<std::uint16_t>(volts * 4096.0 / 3.3 + 0.5);
  }

  std::array<MadeUpBridge, firmware::axis_count> bridges_;
  std::array<Sample, firmware::axis_count> samples_;
  double gain_ = 80.0;
};
static_assert(MotorHardware<MadeUpHardware>);

/// The same under the native board, which gives it its hosts (board::PoweredDevice).
class MadeUpDevice {
 public:
  firmware::AxisInput sample(std::size_t axis) { return power.ISR_measure(axis); }
  std::uint32_t count(std::size_t axis) { return power.hardware().counters[axis]; }
  bool count_valid(std::size_t) { return true; }
  void drive(std::size_t axis, const firmware::AxisOutput& output) {
    last[axis] = output;
    power.ISR_drive(axis, output, static_cast<float>(MadeUpHardware::supply));
  }
  void advance(double duration) { power.hardware().advance(duration); }
  firmware::BoardReadings readings() { return power.readings(); }
  void poll(const firmware::Application& application, std::uint32_t now_us) {
    power.poll(application, now_us);
  }

  /// 1 um a count in these tests.
  void stand_at(int count, std::size_t axis) {
    power.hardware().counters[axis] = static_cast<std::uint16_t>(count);
  }

  Power<MadeUpHardware> power{MadeUpHardware::supply_ratio};
  std::array<firmware::AxisOutput, firmware::axis_count> last{};
};
static_assert(PoweredDevice<MadeUpDevice>);

}  // namespace kmax::board
