// A motor that runs away, with everything that lies between the firmware's tick of an axis and the handle:
// Fault::spin_out must come in time where commutation or direction is wrong, and not where they are right.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "firmware/drive/axis.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/simulated_board/simulated_power_hardware.hpp"
#include "host_tools/simulation/converter_code.hpp"
#include "tests/host_tools/simulated_board/torque_ripple.hpp"

namespace kmax::simulated_board::spin_out_test {

using firmware::Fault;

constexpr double pi = 3.14159265358979323846;
constexpr double tick = 50e-6;

struct Wrong {
  double angle = 0.0;     // rad, of the electrical offset
  bool reversed = false;  // encoder.direction
};

struct Course {
  Fault fault = Fault::none;
  double time = 0.0, travelled = 0.0;  // s, m: when it tripped, or at the end
};

class SpinOut {
 public:
  SpinOut(const std::string& scene, const Wrong& wrong, float hand_force) : scene_(open_scene(scene)) {
    auto& axis = scene_.axes[0];
    axis.encoder.reversed = false;  // as calibrated
    axis.device.force_limit = 0.0;
    firmware::MotorControlConfig motor = torque_ripple::motor_config_of(axis, 0.0);
    motor.current_limit = 10.0f;
    if (const auto* three = std::get_if<simulation::SynchronousMotorConfig>(&*axis.motor))
      motor.electrical_offset =
          static_cast<float>(std::remainder(three->electrical_offset + wrong.angle, 2 * pi));
    pmsm_ = motor.kind == firmware::MotorKind::pmsm;
    setting_.motor = firmware::MotorControl::prepare(motor);
    control::MotionPlausibilityConfig<float> plausibility{.mass = static_cast<float>(axis.device.mass),
                                                          .hand_force = hand_force};
    setting_.plausibility = control::MotionPlausibility<float>::prepare(
        plausibility, static_cast<float>(firmware::Axis::motion_look * tick));
    setting_.watch_motion = true;
    setting_.supply = firmware::SupplyWindow(0.0f, 100.0f);
    setting_.encoder_direction = wrong.reversed ? -1 : 1;
    setting_.generation = 1;
  }

  double mass() const { return scene_.axes[0].device.mass; }
  double friction() const { return scene_.axes[0].device.friction; }

  /// A constant force, no wall, nobody holds the handle.
  Course under(double force) {
    haptic(-10.0);
    return run(force);
  }
  /// The handle begins 2 mm inside a wall of 1 N/mm; nobody holds it.
  Course in_wall() {
    haptic(0.002);
    return run(0.0);
  }

 private:
  void haptic(double wall_position) {
    control::HapticLoopConfig<float> config;
    config.count_length = scene_.axes[0].encoder.count_length();
    config.force.ramp_time = 0.0f;
    config.wall.kind = control::WallKind::plain;
    config.wall.stiffness = 1000.0f;
    config.wall_position = wall_position;
    setting_.haptic = control::HapticLoop<float>::prepare(config, 0);
  }

  Course run(double force) {
    simulation::MotorDrive drive = scene_.make_drive(0);
    simulation::Supply supply = scene_.make_supply();
    drive.current_sensor().set_gain(40.0);
    const auto pin = [&](simulation::CurrentSensor::Channel channel) {
      return simulation::converter_code(drive.current_pin(channel)) * drivers::converter_reference /
             drivers::converter_codes;
    };
    using Channel = simulation::CurrentSensor::Channel;
    double zero_b = 0.0, zero_c = 0.0;
    for (int n = 0; n < 256; ++n) {
      zero_b += pin(Channel::b) / 256;
      zero_c += pin(Channel::c) / 256;
    }
    const double per_volt = 1.0 / (40.0 * drive.current_sensor().config().shunt);
    firmware::Axis axis;
    simulation::InverterCommand command{.dead_time = 20 / 168e6};
    for (std::uint32_t n = 0; n < 20000; ++n) {
      firmware::Axis::Input in{};
      in.count = static_cast<std::uint32_t>(drive.encoder().edges());
      in.count_valid = true;
      in.motor = {true, static_cast<float>(supply.voltage()),
                  static_cast<float>((pin(Channel::b) - zero_b) * per_volt),
                  static_cast<float>((pin(Channel::c) - zero_c) * per_volt)};
      const auto& out =
          axis.ISR_tick(setting_, in, {.enable = true, .from_axes = static_cast<float>(force)}, n);
      if (axis.ISR_fault() != Fault::none) return {axis.ISR_fault(), n * tick, drive.handle().position()};
      const auto leg = [&](float duty) { return simulation::LegCommand{true, static_cast<double>(duty)}; };
      simulation::InverterCommand next = command;
      next.legs = {leg(out.motor.duty_a), leg(out.motor.duty_b), leg(out.motor.duty_c)};
      next.legs[0].enabled = pmsm_;
      for (const auto* now : {&command, &next}) {
        drive.advance(0.5 * tick, *now, supply);
        supply.advance(0.5 * tick);
      }
      command = next;
    }
    return {Fault::none, 1.0, drive.handle().position()};
  }

  simulation::Scene scene_;
  firmware::AxisSetting setting_{};
  bool pmsm_ = false;
};

TEST(SpinOutOfAMotor, ARightMotorNeverTrips) {
  for (const char* const scene : {"gimbal_a", "gimbal_b", "drone", "dc_coreless_a", "dc_coreless_b"}) {
    SpinOut motor(scene, {}, 0.5f);
    EXPECT_EQ(motor.under(3.0).fault, Fault::none) << scene;
    EXPECT_EQ(motor.under(-3.0).fault, Fault::none) << scene;
    EXPECT_EQ(motor.in_wall().fault, Fault::none) << scene;
  }
}

// The bound of motion_plausibility.hpp: the way, the time to run it with the force that is left, 3 x
// smoothing.
TEST(SpinOutOfAMotor, AWrongElectricalAngleTripsInTime) {
  constexpr double force = 3.0, hand = 3.0, tolerance = 0.02;
  for (const char* const scene : {"gimbal_a", "gimbal_b"}) {
    for (const double degrees : {105.0, 120.0, 150.0, 180.0, -150.0}) {
      SpinOut motor(scene, {degrees * pi / 180, false}, static_cast<float>(hand));
      const Course course = motor.under(force);
      ASSERT_EQ(course.fault, Fault::spin_out) << scene << ' ' << degrees;
      const double turned = -force * std::cos(degrees * pi / 180);
      const double way = 17.0 / 16.0 * tolerance / (force + turned - motor.friction() - hand);
      // Viscous friction of 0.4 N s/m takes up to 0.3 N of it; half as long again is room for that.
      const double time = std::sqrt(2 * way * motor.mass() / (turned - motor.friction()));
      EXPECT_LT(course.time, 1.5 * time + 0.006) << scene << ' ' << degrees;
      EXPECT_LT(std::fabs(course.travelled), 2.0 * way + 0.006) << scene << ' ' << degrees;
    }
  }
}

// A reversed direction is wrong for DC motors as 180 degrees are for synchronous ones; in a wall it throws
// the handle ever farther in.
TEST(SpinOutOfAMotor, AReversedDirectionTrips) {
  for (const char* const scene : {"dc_coreless_a", "dc_coreless_b"}) {
    SpinOut motor(scene, {0.0, true}, 3.0f);
    EXPECT_EQ(motor.under(3.0).fault, Fault::spin_out) << scene;
    const Course course = SpinOut(scene, {0.0, true}, 1.0f).in_wall();
    EXPECT_EQ(course.fault, Fault::spin_out) << scene;
    EXPECT_LT(std::fabs(course.travelled), 0.015) << scene;
  }
  EXPECT_EQ(SpinOut("gimbal_a", {pi, false}, 1.5f).in_wall().fault, Fault::spin_out);
}

// What the header says cannot be told: no torque, no motion; and a run-away that a hand could be.
TEST(SpinOutOfAMotor, WhatAHandCouldDoDoesNotTrip) {
  EXPECT_EQ(SpinOut("gimbal_a", {pi / 2, false}, 3.0f).under(3.0).fault, Fault::none);
  EXPECT_EQ(SpinOut("gimbal_a", {pi, false}, 6.0f).under(3.0).fault, Fault::none);
}

}  // namespace kmax::simulated_board::spin_out_test
