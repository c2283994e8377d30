// The simulated motors of the supplied scene under the current controllers of control/, through everything
// that lies between them: converter codes, encoder counts, the delay of the PWM, dead time. That both sides
// mean the same by signs, angles and the torque constant shows here or nowhere.
#include <gtest/gtest.h>

#include <cmath>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::motor_under_control_test {
namespace {

constexpr float tick = 50e-6f;
constexpr double half_tick = 25e-6;

class ControlledAxis {
 public:
  ControlledAxis(const Scene& scene, std::size_t axis)
      : drive_(scene.make_drive(axis)), supply_(scene.make_supply()), encoder_(scene.axes[axis].encoder) {
    control::DcCurrentControllerConfig<float> dc;
    control::FieldOrientedControllerConfig<float> pmsm;
    if (const auto* motor = std::get_if<BrushedDcMotorConfig>(&*scene.axes[axis].motor)) {
      dc = {static_cast<float>(motor->resistance), static_cast<float>(motor->inductance),
            static_cast<float>(motor->torque_constant), 3000.0f, 0.88f};
      constant_ = motor->torque_constant;
    } else {
      const auto& three = std::get<SynchronousMotorConfig>(*scene.axes[axis].motor);
      pmsm = {static_cast<float>(three.resistance),
              static_cast<float>(three.inductance_d),
              static_cast<float>(three.inductance_q),
              static_cast<float>(three.torque_constant),
              static_cast<std::int32_t>(three.pole_pairs),
              3000.0f,
              0.88f};
      constant_ = three.torque_constant;
      offset_ = three.electrical_offset;
      pole_pairs_ = three.pole_pairs;
    }
    dc_ = control::DcCurrentController<float>::prepare(dc, tick);
    pmsm_ = control::FieldOrientedController<float>::prepare(pmsm, tick);
    command_.dead_time = 119e-9;
    for (std::size_t k = 0; k < 2; ++k) zero_[k] = pin(k);
  }

  double position() const { return static_cast<double>(drive_.encoder().edges()) * encoder_.count_length(); }
  MotorDrive& drive() { return drive_; }

  // One tick: sampled in the middle of the PWM period, the duty acts from its end.
  void step(double force) {
    const auto reference = static_cast<float>(force * encoder_.transmission / constant_);
    const auto b = static_cast<float>(amperes(0)), c = static_cast<float>(amperes(1));
    const auto supply = static_cast<float>(supply_.voltage());
    const double turns = static_cast<double>(drive_.encoder().edges()) / encoder_.counts_per_turn;
    const auto speed = static_cast<float>(drive_.shaft_speed());
    InverterCommand next = command_;
    if (drive_.brushed()) {
      const auto out = brushed_.update(dc_, reference, (b - c) / 2, speed, supply);
      next.legs = {
          {{false, 0.0}, {true, static_cast<double>(out.duty_b)}, {true, static_cast<double>(out.duty_c)}}};
    } else {
      const double electrical = pole_pairs_ * turns + offset_ / 6.283185307179586;
      const auto angle =
          static_cast<control::TurnFraction>((electrical - std::floor(electrical)) * 4294967295.0);
      const auto out = three_.update(
          pmsm_, {angle, b, c, speed * static_cast<float>(pole_pairs_), 0.0f, reference, supply});
      next.legs = {{{true, static_cast<double>(out.duty_a)},
                    {true, static_cast<double>(out.duty_b)},
                    {true, static_cast<double>(out.duty_c)}}};
    }
    advance();
    command_ = next;
    advance();
  }

 private:
  double pin(std::size_t channel) {
    const double volt = drive_.current_pin(static_cast<CurrentSensor::Channel>(channel), true);
    return std::floor(volt / 3.3 * 4096.0) * 3.3 / 4096.0;
  }
  double amperes(std::size_t channel) { return (pin(channel) - zero_[channel]) / (40.0 * 0.5e-3); }
  void advance() {
    drive_.advance(half_tick, command_, supply_);
    supply_.advance(half_tick);
  }

  MotorDrive drive_;
  Supply supply_;
  EncoderConfig encoder_;
  double constant_ = 0.0;
  double offset_ = 0.0;
  double pole_pairs_ = 1.0;
  control::DcCurrentController<float> brushed_;
  control::FieldOrientedController<float> three_;
  control::DcCurrentController<float>::Coefficients dc_{};
  control::FieldOrientedController<float>::Coefficients pmsm_{};
  InverterCommand command_;
  double zero_[2]{};
};

TEST(MotorUnderControl, TheForceThatIsAskedForArrives) {
  const Scene scene = scene_file("motor_axes");
  for (std::size_t axis = 0; axis < 2; ++axis) {
    // At several places of the turn: a wrong electrical angle would be right at some.
    for (const double start : {0.0, 0.0011, 0.0047, 0.03}) {
      Scene there = scene;
      there.axes[axis].start.position = start;
      there.axes[axis].motion->start_position = start;
      ControlledAxis controlled(there, axis);
      controlled.drive().block(true);
      for (const double force : {3.3, -2.0}) {
        for (int n = 0; n < 200; ++n) controlled.step(force);
        double sum = 0.0;
        for (int n = 0; n < 200; ++n) {
          controlled.step(force);
          sum += controlled.drive().force();
        }
        // Half a converter code is 20 mA: 0.06 N and 0.1 N.
        EXPECT_NEAR(sum / 200, force, 0.15) << axis << " at " << start;
      }
    }
  }
}

TEST(MotorUnderControl, APersonPressesBothHandlesAgainstTheirWalls) {
  const Scene scene = scene_file("motor_axes");
  for (std::size_t axis = 0; axis < 2; ++axis) {
    ControlledAxis controlled(scene, axis);
    controlled.drive().handle().begin_motion();
    double least = 1.0, most = -1.0, force = 0.0;
    for (int n = 0; n < 30000; ++n) {  // 1.5 s
      controlled.step(std::fmax(0.0, -2000.0 * (controlled.position() + 0.02)));
      if (n < 20000) continue;
      least = std::fmin(least, controlled.drive().handle().position());
      most = std::fmax(most, controlled.drive().handle().position());
      force += controlled.drive().force() / 10000;
    }
    EXPECT_LT(most - least, 0.1e-3) << axis << ": it rings";
    EXPECT_NEAR(force, 1.0, 0.25) << axis;
    EXPECT_NEAR(least, -0.02 - force / 2000.0, 0.1e-3) << axis;
  }
}

}  // namespace
}  // namespace kmax::simulation::motor_under_control_test
