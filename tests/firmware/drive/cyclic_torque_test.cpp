#include "firmware/drive/cyclic_torque.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::cyclic_torque_test {
namespace {

ParameterValues in_mode_torque(std::int32_t target, std::size_t axis = 0) {
  ParameterValues values;
  values.set_whole<"drive.mode">(static_cast<std::uint32_t>(DriveMode::torque), axis);
  values.set_whole<"profile.target_torque">(static_cast<std::uint32_t>(target), axis);
  return values;
}

float share_of(const ParameterValues& values, std::size_t axis = 0) {
  return commanded_force(values, axis, true, false);
}

TEST(CyclicTorque, ItsTargetsAreTwo) {
  int targets = 0;
  for (std::size_t entry = 0; entry < entry_count; ++entry) targets += is_target(entry) ? 1 : 0;
  EXPECT_EQ(targets, 2);
  EXPECT_TRUE(is_target(entry_of<"profile.target_torque">()));
  EXPECT_TRUE(is_target(entry_of<"profile.target_force">()));
}

TEST(CyclicTorque, RatedValuesAreWholeAndAtLeastOne) {
  struct Case {
    float limit, constant;
    std::uint32_t current, torque;
  };
  for (const Case& c :
       {Case{5.0f, 0.05f, 5000, 250}, Case{0.1f, 1e-5f, 100, 1}, Case{120, 100, 120000, 12000000},
        Case{1.0f, 0.0104f, 1000, 10}, Case{1.0f, 0.0106f, 1000, 11}, Case{0.1f, 0.014f, 100, 1},
        Case{0.1f, 0.016f, 100, 2}, Case{2.0004f, 0.1f, 2000, 200}, Case{2.0006f, 0.1f, 2001, 200}}) {
    ParameterValues values;
    values.set_real<"current.limit">(c.limit, 1);
    values.set_real<"motor.torque_constant">(c.constant, 1);
    EXPECT_EQ(rated_current(values, 1), c.current) << c.limit;
    EXPECT_EQ(rated_torque(values, 1), c.torque) << c.limit << " " << c.constant;
    EXPECT_EQ(rated_torque(values, 0), 250u) << "the other axis has its own";
  }
}

TEST(CyclicTorque, ForceIsTheTorqueOverTheTransmissionAlongX) {
  // 250 mN m of rated torque on a transmission of 0.05 m/rad: 5 N.
  EXPECT_NEAR(share_of(in_mode_torque(1000)), 5.0, 5e-6);
  EXPECT_NEAR(share_of(in_mode_torque(-1000)), -5.0, 5e-6);
  EXPECT_NEAR(share_of(in_mode_torque(1)), 0.005, 5e-9);
  EXPECT_EQ(share_of(in_mode_torque(0)), 0.0f);
  EXPECT_NEAR(share_of(in_mode_torque(500, 1), 1), 2.5, 5e-6);
  EXPECT_EQ(share_of(in_mode_torque(500, 1), 0), 0.0f) << "the other axis' target";
  ParameterValues values = in_mode_torque(1000);
  values.set_real<"device.transmission">(0.1f);
  EXPECT_NEAR(share_of(values), 2.5, 5e-6);
  // Nothing of it by way of the encoder's direction, which the position already has.
  values.set_whole<"encoder.direction">(static_cast<std::uint32_t>(-1));
  EXPECT_NEAR(share_of(values), 2.5, 5e-6);
}

TEST(CyclicTorque, NewtonsAtTheHandleAreAddedToTheTorquesForce) {
  ParameterValues values = in_mode_torque(0);
  values.set_real<"profile.target_force">(-2.5f);
  EXPECT_EQ(share_of(values), -2.5f);
  EXPECT_EQ(share_of(values, 1), 0.0f) << "the other axis has its own";
  values.set_whole<"profile.target_torque">(1000);
  EXPECT_NEAR(share_of(values), 2.5, 5e-6);
  values.set_whole<"profile.max_torque">(0);
  EXPECT_EQ(share_of(values), -2.5f) << "which bounds the torque";
}

// What a host computes from the two objects it reads, and not from the parameters behind them.
TEST(CyclicTorque, CountsInTheRatedTorqueThatAHostReads) {
  ParameterValues values = in_mode_torque(1000);
  values.set_real<"current.limit">(0.1f);
  values.set_real<"motor.torque_constant">(0.016f);  // 1.6 mN m, told as 2
  EXPECT_NEAR(share_of(values), 0.002 / 0.05, 1e-7);
  values.set_real<"motor.torque_constant">(1e-5f);  // 1 uN m, told as 1 mN m
  EXPECT_NEAR(share_of(values), 0.001 / 0.05, 1e-7);
}

TEST(CyclicTorque, IsBoundedByMaxTorqueBothWays) {
  ParameterValues values = in_mode_torque(2000);
  EXPECT_NEAR(share_of(values), 5.0, 5e-6) << "the default bound is the rated torque";
  values.set_whole<"profile.max_torque">(2000);
  EXPECT_NEAR(share_of(values), 10.0, 1e-5);
  values.set_whole<"profile.max_torque">(300);
  EXPECT_NEAR(share_of(values), 1.5, 5e-6);
  values.set_whole<"profile.target_torque">(static_cast<std::uint32_t>(-32768));
  EXPECT_NEAR(share_of(values), -1.5, 5e-6);
  values.set_whole<"profile.max_torque">(32767);
  EXPECT_NEAR(share_of(values), -32.767 * 5, 2e-4);
  values.set_whole<"profile.max_torque">(0);
  EXPECT_EQ(share_of(values), 0.0f);
}

TEST(CyclicTorque, NothingUnlessArmedInModeTorqueAndNotHalted) {
  for (const DriveMode mode : {DriveMode::haptic, DriveMode::excitation, DriveMode::torque}) {
    for (const bool armed : {false, true}) {
      for (const bool is_halted : {false, true}) {
        ParameterValues values = in_mode_torque(1000);
        values.set_whole<"drive.mode">(static_cast<std::uint32_t>(mode));
        values.set_real<"profile.target_force">(1.0f);
        const bool acts = mode == DriveMode::torque && armed && !is_halted;
        EXPECT_EQ(commanded_force(values, 0, armed, is_halted) != 0.0f, acts)
            << static_cast<int>(mode) << armed << is_halted;
        EXPECT_EQ(std::signbit(commanded_force(values, 0, armed, is_halted)), false);
      }
    }
  }
}

RC_GTEST_PROP(CyclicTorque, IsFiniteAndAsExactAsFloatForAllParameters, ()) {
  const auto in = [](double low, double high) {
    return static_cast<float>(low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0));
  };
  ParameterValues values = in_mode_torque(*rc::gen::inRange(-32768, 32768));
  values.set_whole<"profile.max_torque">(static_cast<std::uint32_t>(*rc::gen::inRange(0, 32768)));
  values.set_real<"current.limit">(in(0.1, 120));
  values.set_real<"motor.torque_constant">(in(1e-5, 100));
  values.set_real<"device.transmission">(in(1e-6, 10));
  const double product =
      double(values.real<"current.limit">()) * double(values.real<"motor.torque_constant">());
  const std::uint32_t rated = rated_torque(values, 0);
  RC_ASSERT(rated >= 1);
  RC_ASSERT(std::abs(std::max(1.0, 1e3 * product) - rated) <= 0.5 + 1e-6 * rated);
  const int bound = values.whole<"profile.max_torque">();
  const int target = std::clamp(values.whole<"profile.target_torque">(), -bound, bound);
  const double by_torque = 1e-6 * target * rated / double(values.real<"device.transmission">());
  const auto newtons = static_cast<float>(*rc::gen::inRange(-1000, 1001));
  values.set_real<"profile.target_force">(newtons);
  const float force = share_of(values);
  RC_ASSERT(std::isfinite(force));
  RC_ASSERT(std::abs(double(force) - (by_torque + double(newtons))) <=
            1e-6 * (std::abs(by_torque) + std::abs(double(newtons))));
}

// The newtons arrive as current, by way of transmission and torque constant and within force.limit.
RC_GTEST_PROP(CyclicTorque, NewtonsArriveAsTheCurrentThatMakesThem, ()) {
  const auto in = [](double low, double high) {
    return static_cast<float>(low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0));
  };
  ParameterValues values = in_mode_torque(0);
  values.set_real<"profile.target_force">(*rc::gen::element(-1.0f, 1.0f) * in(1e-3, 100));
  values.set_real<"force.limit">(in(1e-2, 50));
  values.set_real<"force.slew_limit">(1e9f);
  values.set_real<"force.ramp_time">(0.0f);
  values.set_real<"current.limit">(120.0f);
  values.set_real<"motor.torque_constant">(in(1e-2, 1));
  values.set_real<"device.transmission">(in(1e-3, 1e-1));
  AxisSetting setting;
  setting.haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, 0), 0);
  setting.motor = MotorControl::prepare(motor_configuration(values, 0, 25.0f, 1.0f));
  setting.mode = DriveMode::torque;
  Axis axis;
  const Axis::Input input{.count = 0, .count_valid = true, .condition = Fault::none, .motor = {}};
  const Axis::Output* output = nullptr;
  for (std::uint32_t tick = 1; tick <= 100; ++tick)
    output = &axis.ISR_tick(setting, input, {true, 0.0f, share_of(values)}, tick);
  const double limit = double(values.real<"force.limit">());
  const double force = std::clamp(double(values.real<"profile.target_force">()), -limit, limit);
  const double per_newton =
      double(values.real<"device.transmission">()) / double(values.real<"motor.torque_constant">());
  const double current = std::clamp(force * per_newton, -120.0, 120.0);
  RC_ASSERT(output->enabled);
  RC_ASSERT(std::abs(double(output->motor.current_reference) - current) <= 1e-5 * std::abs(current));
}

}  // namespace
}  // namespace kmax::firmware::cyclic_torque_test
