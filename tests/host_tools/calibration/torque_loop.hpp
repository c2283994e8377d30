#pragma once
// A bench motor under the current controllers of control/: torque current in, what a capture would show out.

#include <cmath>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "tests/host_tools/calibration/motor_bench.hpp"

namespace kmax::calibration::test {

// Half period in s of a square-wave force (N) that swings a free mass (kg) by `swing` (m, peak to peak): from
// rest at one end to the fastest in the middle.
inline double swing_half_period(double swing, double force, double mass) {
  return 2.0 * std::sqrt(swing * mass / force);
}

struct TorqueRecord {
  std::vector<double> voltage, current, current_d, count, electrical_angle;
  double counts_per_turn = 1.0, transmission = 1.0;

  std::vector<double> shaft_angle() const {
    std::vector<double> out;
    for (const double c : count) out.push_back(c * two_pi / counts_per_turn);
    return out;
  }
  std::vector<double> position() const {
    std::vector<double> out;
    for (const double c : count) out.push_back(c * two_pi / counts_per_turn * transmission);
    return out;
  }
  std::vector<double> force(double torque_constant) const {
    std::vector<double> out;
    for (const double i : current) out.push_back(i * torque_constant / transmission);
    return out;
  }
};

class TorqueLoop {
 public:
  explicit TorqueLoop(MotorBench& bench) : bench_(bench) {
    const BenchMotor& motor = bench.motor();
    if (motor.brushed()) {
      control::DcCurrentControllerConfig<float> config;
      config.resistance = static_cast<float>(motor.resistance());
      config.inductance = static_cast<float>(motor.inductance());
      config.bandwidth = 3000.0f;
      config.modulation_limit = motor.modulation_limit();
      dc_coefficients_ = control::DcCurrentController<float>::prepare(config, static_cast<float>(tick));
    } else {
      control::FieldOrientedControllerConfig<float> config;
      config.resistance = static_cast<float>(motor.resistance());
      config.inductance_d = static_cast<float>(motor.pmsm().inductance_d);
      config.inductance_q = static_cast<float>(motor.pmsm().inductance_q);
      config.pole_pairs = static_cast<std::int32_t>(motor.pmsm().pole_pairs);
      config.bandwidth = 3000.0f;
      config.modulation_limit = motor.modulation_limit();
      three_coefficients_ =
          control::FieldOrientedController<float>::prepare(config, static_cast<float>(tick));
    }
    record_.counts_per_turn = motor.counts_per_turn;
    record_.transmission = motor.transmission;
  }

  double count() const { return last_count_; }
  void keep(bool on) { keeps_ = on; }
  TorqueRecord take() {
    TorqueRecord out = record_;
    record_ = TorqueRecord();
    record_.counts_per_turn = out.counts_per_turn;
    record_.transmission = out.transmission;
    return out;
  }

  // One tick with this torque current asked for, A.
  void step(double reference) {
    const BenchSample sample = bench_.sample();
    last_count_ = sample.count;
    if (bench_.motor().brushed()) {
      const double current = 0.5 * (sample.current_b - sample.current_c);
      const auto out = dc_.update(dc_coefficients_, static_cast<float>(reference),
                                  static_cast<float>(current), 0.0f, static_cast<float>(sample.supply));
      note(sample, static_cast<double>(out.voltage), current, 0.0, 0.0);
      bench_.tick_with(0.5, static_cast<double>(out.duty_b), static_cast<double>(out.duty_c));
      return;
    }
    const auto& pmsm = bench_.motor().pmsm();
    const double electrical = pmsm.pole_pairs * bench_.shaft_angle_of(sample.count) + pmsm.electrical_offset;
    const double turns = electrical / two_pi;
    control::FieldOrientedController<float>::Input in;
    in.angle = static_cast<control::TurnFraction>((turns - std::floor(turns)) * 4294967295.0);
    in.current_b = static_cast<float>(sample.current_b);
    in.current_c = static_cast<float>(sample.current_c);
    const simulation::MotorDrive& drive = bench_.drive();
    in.electrical_speed = static_cast<float>(pmsm.pole_pairs * drive.handle().velocity() /
                                             drive.encoder().config().transmission);
    in.reference_q = static_cast<float>(reference);
    in.supply = static_cast<float>(sample.supply);
    const auto out = three_.update(three_coefficients_, in);
    note(sample, static_cast<double>(out.voltage_q), static_cast<double>(out.current_q),
         static_cast<double>(out.current_d), electrical);
    bench_.tick_with(static_cast<double>(out.duty_a), static_cast<double>(out.duty_b),
                     static_cast<double>(out.duty_c));
  }

 private:
  void note(const BenchSample& sample, double voltage, double current, double current_d, double electrical) {
    if (!keeps_) return;
    record_.voltage.push_back(voltage);
    record_.current.push_back(current);
    record_.current_d.push_back(current_d);
    record_.count.push_back(sample.count);
    record_.electrical_angle.push_back(electrical);
  }

  MotorBench& bench_;
  control::DcCurrentController<float> dc_;
  control::DcCurrentController<float>::Coefficients dc_coefficients_{};
  control::FieldOrientedController<float> three_;
  control::FieldOrientedController<float>::Coefficients three_coefficients_{};
  TorqueRecord record_;
  double last_count_ = 0.0;
  bool keeps_ = true;
};

// A square wave of torque current; what a capture of `samples` ticks after `settling` ticks shows.
inline TorqueRecord oscillate(MotorBench& bench, double current, int half_period, std::size_t settling,
                              std::size_t samples) {
  TorqueLoop loop(bench);
  for (std::size_t k = 0; k < settling + samples; ++k) {
    loop.keep(k >= settling);
    // The first half wave is half as long: the handle then swings about where it was.
    const bool up =
        ((k + static_cast<std::size_t>(half_period) / 2) / static_cast<std::size_t>(half_period)) % 2 == 0;
    loop.step(up ? current : -current);
  }
  return loop.take();
}

}  // namespace kmax::calibration::test
