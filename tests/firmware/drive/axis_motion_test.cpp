// The axis with a motor and a handle that move: what is excited must move the way the parameters say, and a
// motor that runs away must be caught by what it really does.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_configuration.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::firmware::axis_motion_test {
namespace {

constexpr double turn = 6.283185307179586;
constexpr double tick = control::test::tick;
constexpr double transmission = 0.01;  // m/rad
constexpr double torque_constant = 0.05;
constexpr double pole_pairs = 7.0;
constexpr std::int32_t counts_per_turn = 8192;
constexpr double count_length = turn * transmission / counts_per_turn;
constexpr double offset = 1.3;  // rad, electrical, at position zero

/// A handle of 50 g with viscous friction on a motor of either kind; 24 V, currents measured exactly.
class MovingHandle {
 public:
  explicit MovingHandle(MotorKind kind) : kind_(kind) {
    dc_.torque_constant = torque_constant;
    synchronous_.flux = torque_constant / 1.5 / pole_pairs;
    synchronous_.angle = offset;
  }

  Axis::Input input() const {
    Axis::Input in{};
    const auto counts = static_cast<std::int64_t>(std::floor(position / count_length));
    in.count = static_cast<std::uint32_t>(reversed ? -counts : counts);
    in.count_valid = true;
    in.motor.present = true;
    in.motor.supply_voltage = 24.0f;
    if (kind_ == MotorKind::dc) {
      in.motor.current_b = static_cast<float>(dc_.current);
      in.motor.current_c = -in.motor.current_b;
    } else {
      const auto phases = synchronous_.currents();
      in.motor.current_b = static_cast<float>(phases.b);
      in.motor.current_c = static_cast<float>(phases.c);
    }
    return in;
  }

  void run(const MotorControl::Output& out, bool enabled) {
    const double speed = velocity / transmission;
    double current = 0.0;
    if (kind_ == MotorKind::dc) {
      dc_.speed = speed;
      dc_.run(enabled ? static_cast<double>(out.duty_b - out.duty_c) * 24.0 : 0.0);
      current = dc_.current;
    } else {
      synchronous_.electrical_speed = pole_pairs * speed;
      synchronous_.run(
          {static_cast<double>(out.duty_a), static_cast<double>(out.duty_b), static_cast<double>(out.duty_c)},
          24.0);
      current = synchronous_.current_q;
    }
    force = current * torque_constant / transmission;
    position += velocity * tick;
    velocity += (force + hand - damping * velocity) / 0.05 * tick;
  }

  double position = 0.0, velocity = 0.0, force = 0.0, damping = 5.0;
  double hand = 0.0;      // N along +x
  bool reversed = false;  // the counter counts the other way

 private:
  MotorKind kind_;
  control::test::DcMotor dc_;
  control::test::SynchronousMotor synchronous_;
};

AxisSetting setting_of(MotorKind kind, DriveMode mode, double electrical_offset = offset) {
  control::HapticLoopConfig<float> haptic;
  haptic.count_length = count_length;
  haptic.force.ramp_time = 0.0f;
  haptic.wall.kind = control::WallKind::plain;
  MotorControlConfig motor;
  motor.modulation_limit = 0.88f;
  motor.kind = kind;
  motor.transmission = static_cast<float>(transmission);
  motor.torque_constant = static_cast<float>(torque_constant);
  motor.resistance = kind == MotorKind::dc ? 1.0f : 0.5f;
  motor.electrical_offset = static_cast<float>(electrical_offset);
  motor.counts_per_turn = counts_per_turn;
  control::MotionPlausibilityConfig<float> motion;
  motion.hand_force = 2.0f;
  AxisSetting setting;
  setting.haptic = control::HapticLoop<float>::prepare(haptic, 0);
  setting.motor = MotorControl::prepare(motor);
  setting.plausibility =
      control::MotionPlausibility<float>::prepare(motion, static_cast<float>(Axis::motion_look * tick));
  setting.watch_motion = true;
  setting.supply = SupplyWindow(0.0f, 60.0f);
  setting.generation = 1;
  setting.mode = mode;
  return setting;
}

ExcitationConfig excitation_of(ExcitationKind kind) {
  ExcitationConfig config = excitation_configuration({}, 0);
  config.kind = kind;
  config.travel = 0.05f;
  config.duration = 10.0f;
  config.count_length = count_length;
  return config;
}

class AxisMotion : public testing::Test {
 protected:
  /// False: a fault.
  bool run(MovingHandle& handle, const AxisSetting& setting, double seconds, bool enable = true) {
    for (double time = 0.0; time < seconds; time += tick) {
      const auto out = axis.ISR_tick(setting, handle.input(), {.enable = enable}, ++ticks);
      handle.run(out.motor, out.enabled);
      made = out.motor;
      if (axis.ISR_report().fault != Fault::none) return false;
    }
    return true;
  }
  /// Arms and starts what is set. False: a fault.
  bool begin(MovingHandle& handle, AxisSetting& setting, ExcitationConfig config) {
    setting.excitation = Excitation::prepare(config);
    if (!run(handle, setting, 0.01, false) || !run(handle, setting, tick)) return false;
    ++config.run;
    setting.excitation = Excitation::prepare(config);
    return true;
  }
  Axis axis;
  MotorControl::Output made;
  std::uint32_t ticks = 0;
};

TEST_F(AxisMotion, ATurningCurrentDragsTheRotorAlongBySpanOverPolePairs) {
  for (const double rate : {30.0, -30.0}) {
    MovingHandle handle(MotorKind::pmsm);
    axis = Axis();
    // Nothing may depend on what is configured about the rotor: the offset is wrong.
    AxisSetting setting = setting_of(MotorKind::pmsm, DriveMode::excitation, offset + 2.0);
    ExcitationConfig config = excitation_of(ExcitationKind::current);
    config.bias = 2.0f;
    ASSERT_TRUE(begin(handle, setting, config));
    ASSERT_TRUE(run(handle, setting, 0.5));
    const double aligned = handle.position;
    EXPECT_NEAR(aligned * pole_pairs / transmission, -offset, 0.01) << "d along the vector at angle 0";
    config.run = 1;
    config.angle_rate = static_cast<float>(rate);
    config.angle_span = static_cast<float>(2 * turn);
    setting.excitation = Excitation::prepare(config);
    ASSERT_TRUE(run(handle, setting, 1.0));
    const double expected = (rate > 0 ? 2.0 : -2.0) * turn / pole_pairs * transmission;
    EXPECT_NEAR(handle.position - aligned, expected, 2e-5);
    EXPECT_NEAR(made.current, 2.0f, 0.01f);
    EXPECT_NEAR(made.current_d, 0.0f, 0.01f);
  }
}

TEST_F(AxisMotion, PositionKindCarriesTheHandleByItsStroke) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    for (const float stroke : {0.004f, -0.004f}) {
      MovingHandle handle(kind);
      axis = Axis();
      AxisSetting setting = setting_of(kind, DriveMode::excitation);
      ExcitationConfig config = excitation_of(ExcitationKind::position);
      config.stiffness = 500.0f;
      config.damping = 5.0f;
      config.speed = 0.01f;
      config.stroke = stroke;
      ASSERT_TRUE(begin(handle, setting, config));
      ASSERT_TRUE(run(handle, setting, 0.2));
      EXPECT_NEAR(handle.position, stroke > 0 ? 0.002 : -0.002, 2e-4) << "half way";
      ASSERT_TRUE(run(handle, setting, 1.0));
      EXPECT_NEAR(handle.position, static_cast<double>(stroke), 3e-5);
    }
  }
}

TEST_F(AxisMotion, PositiveTorqueMovesAlongXAndTheForceMadeIsTheRealOne) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    for (const float amperes : {0.5f, -0.5f}) {
      MovingHandle handle(kind);
      axis = Axis();
      AxisSetting setting = setting_of(kind, DriveMode::excitation);
      ExcitationConfig config = excitation_of(ExcitationKind::torque);
      config.bias = amperes;
      config.travel = 1.0f;
      ASSERT_TRUE(begin(handle, setting, config));
      ASSERT_TRUE(run(handle, setting, 0.3));
      EXPECT_GT(handle.velocity * static_cast<double>(amperes), 0.1);
      EXPECT_NEAR(handle.force, 5.0 * static_cast<double>(amperes), 0.05);
      EXPECT_NEAR(static_cast<double>(axis.ISR_report().motor.force_made), handle.force, 0.05);
    }
  }
}

TEST_F(AxisMotion, TravelEndsAMotionThatIsTooWide) {
  MovingHandle handle(MotorKind::dc);
  AxisSetting setting = setting_of(MotorKind::dc, DriveMode::excitation);
  ExcitationConfig config = excitation_of(ExcitationKind::voltage);
  config.bias = 1.0f;
  config.travel = 0.002f;
  ASSERT_TRUE(begin(handle, setting, config));
  EXPECT_FALSE(run(handle, setting, 1.0));
  EXPECT_EQ(axis.ISR_report().fault, Fault::excitation_travel);
  EXPECT_NEAR(handle.position, 0.002, 2e-4);
}

// A wall that should hold the handle throws it in: the commutation is half a turn off.
TEST_F(AxisMotion, AWrongCommutationIsCaughtAsASpinOut) {
  for (const bool wrong : {false, true}) {
    MovingHandle handle(MotorKind::pmsm);
    handle.damping = 1.0;
    handle.position = 0.001;
    axis = Axis();
    // The model's rotor is at `offset` where the handle begins.
    const double there = offset - pole_pairs * handle.position / transmission;
    const AxisSetting setting =
        setting_of(MotorKind::pmsm, DriveMode::haptic, wrong ? there + turn / 2 : there);
    ASSERT_TRUE(run(handle, setting, 0.01, false));
    handle.velocity = -0.1;  // into the wall
    if (!wrong) {
      EXPECT_TRUE(run(handle, setting, 0.5));
      EXPECT_GT(handle.position, -0.001) << "the wall has thrown it back";
      continue;
    }
    EXPECT_FALSE(run(handle, setting, 0.5));
    EXPECT_EQ(axis.ISR_report().fault, Fault::spin_out);
    EXPECT_GT(axis.ISR_report().fault_value, control::MotionPlausibilityConfig<float>{}.tolerance) << "J";
    EXPECT_GT(handle.position, -0.06);
  }
}

// A hand presses steadily into a wall. Held force and a lagging velocity estimate are the haptic loop's own
// business: the motor makes just the force that is asked for, and the handle does what it must.
TEST_F(AxisMotion, NeitherTheHapticRateNorTheEstimatorLooksLikeASpinOut) {
  using enum control::VelocityEstimatorKind;
  for (const std::uint32_t divider : {1U, 4U, 40U}) {
    for (const auto kind : {difference, low_pass, foaw, tracking, edge_period}) {
      for (const float stiffness : {300.0f, 1000.0f, 3000.0f}) {
        for (const double hand : {-1.0, -4.9}) {
          MovingHandle handle(MotorKind::dc);
          handle.position = 0.002;
          handle.damping = 0.2;
          axis = Axis();
          AxisSetting setting = setting_of(MotorKind::dc, DriveMode::haptic);
          control::HapticLoopConfig<float> haptic;
          haptic.count_length = count_length;
          haptic.divider = divider;
          haptic.force.ramp_time = 0.0f;
          haptic.force.limit = 10.0f;
          haptic.velocity.kind = kind;
          haptic.velocity.bandwidth = 100.0f;
          haptic.wall.kind = control::WallKind::plain;
          haptic.wall.stiffness = stiffness;
          setting.haptic = control::HapticLoop<float>::prepare(haptic, 0);
          control::MotionPlausibilityConfig<float> motion;
          motion.hand_force = 5.0f;
          setting.plausibility = control::MotionPlausibility<float>::prepare(
              motion, static_cast<float>(Axis::motion_look * tick));
          ASSERT_TRUE(run(handle, setting, 0.01, false));
          handle.hand = hand;
          EXPECT_TRUE(run(handle, setting, 1.0))
              << divider << " ticks, estimator " << static_cast<int>(kind) << ", " << stiffness << " N/m, "
              << hand << " N: fault " << static_cast<int>(axis.ISR_report().fault);
        }
      }
    }
  }
}

// The counter's own direction must be the one that the force is judged by.
TEST_F(AxisMotion, AReversedEncoderWithItsDirectionSetIsNoSpinOut) {
  for (const std::int32_t direction : {1, -1}) {
    for (const bool set : {true, false}) {
      MovingHandle handle(MotorKind::dc);
      handle.position = 0.001;
      handle.damping = 1.0;
      handle.reversed = direction < 0;
      axis = Axis();
      AxisSetting setting = setting_of(MotorKind::dc, DriveMode::haptic);
      setting.encoder_direction = set ? direction : -direction;
      control::MotionPlausibilityConfig<float> motion;
      motion.hand_force = 0.5f;
      setting.plausibility =
          control::MotionPlausibility<float>::prepare(motion, static_cast<float>(Axis::motion_look * tick));
      ASSERT_TRUE(run(handle, setting, 0.01, false));
      handle.velocity = -0.1;
      EXPECT_EQ(run(handle, setting, 0.5), set) << direction;
      EXPECT_EQ(axis.ISR_report().fault, set ? Fault::none : Fault::spin_out);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_motion_test
