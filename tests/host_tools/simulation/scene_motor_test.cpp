// scene_axis.hpp, through the scenes that it reads.
#include <gtest/gtest.h>

#include <string>

#include "host_tools/simulation/defect.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_motor_test {
namespace {

TEST(SceneMotor, WithoutTheTablesThereIsNoMotor) {
  for (const char* name : {"touch", "free_handle", "two_axes"}) {
    const Scene scene = scene_file(name);
    EXPECT_FALSE(scene.supply);
    for (const SceneAxis& axis : scene.axes) {
      EXPECT_FALSE(axis.motor);
      EXPECT_THROW(axis.make_drive(1), std::logic_error);
    }
  }
  EXPECT_EQ(refusal("[device]\n[encoder]\ncounts_per_turn = 16.5\n"), "accepted") << "an ideal encoder may";
}

TEST(SceneMotor, ReadsEveryTable) {
  const Scene scene = parse_scene(R"(
[supply]
voltage = 12
resistance = 0.1
capacitance = 2e-3
brake_resistance = 3
divider_ratio = 19
absorbs = true
[device]
[encoder]
kind = "as5047p"
counts_per_turn = 16384
index_position = 7
dropout_probability = 0.001
edge_noise = 0.2
[motor]
kind = "dc"
resistance = 2
inductance = 1e-3
torque_constant = 0.04
[inverter]
on_resistance = 0.005
diode_drop = 0.6
[current_sensor]
shunt = 1e-3
gain = 20
noise = 1e-6
offset_b = 0.01
offset_c = -0.01
[axis1.device]
[axis1.motor]
kind = "pmsm"
inductance = 0.4e-3
pole_pairs = 11
electrical_offset = -1
cogging_torque = 0.001
cogging_periods = 84
)",
                                  "m.toml");
  EXPECT_EQ(scene.supply->voltage, 12.0);
  EXPECT_EQ(scene.supply->divider_ratio, 19.0);
  EXPECT_TRUE(scene.supply->absorbs);
  EXPECT_EQ(scene.make_supply().voltage(), 12.0);
  const SceneAxis& axis = scene.axes[0];
  EXPECT_EQ(axis.encoder.kind, EncoderKind::as5047p);
  EXPECT_EQ(axis.encoder.index_position, 7.0);
  EXPECT_EQ(axis.encoder.dropout_probability, 0.001);
  EXPECT_EQ(axis.encoder.edge_noise, 0.2);
  const auto& dc = std::get<BrushedDcMotorConfig>(*axis.motor);
  EXPECT_EQ(dc.resistance, 2.0);
  EXPECT_EQ(dc.inductance, 1e-3);
  EXPECT_EQ(dc.torque_constant, 0.04);
  EXPECT_EQ(axis.inverter.diode_drop, 0.6);
  EXPECT_EQ(axis.current_sensor.gain, 20.0);
  EXPECT_EQ(axis.current_sensor.offset_c, -0.01);
  const auto& pmsm = std::get<SynchronousMotorConfig>(*scene.axes[1].motor);
  EXPECT_EQ(pmsm.inductance_d, 0.4e-3);
  EXPECT_EQ(pmsm.inductance_q, 0.4e-3);
  EXPECT_EQ(pmsm.pole_pairs, 11.0);
  EXPECT_EQ(pmsm.cogging_periods, 84.0);
  EXPECT_EQ(pmsm.resistance, SynchronousMotorConfig{}.resistance);
  EXPECT_EQ(scene.axes[1].encoder.kind, EncoderKind::quadrature);
  const Scene salient =
      parse_scene("[device]\n[motor]\nkind = \"pmsm\"\ninductance_d = 1e-4\ninductance_q = 2e-4\n", "s");
  EXPECT_EQ(std::get<SynchronousMotorConfig>(*salient.axes[0].motor).inductance_d, 1e-4);
  EXPECT_EQ(std::get<SynchronousMotorConfig>(*salient.axes[0].motor).inductance_q, 2e-4);
}

TEST(SceneMotor, RefusalsNamePlaceKeyValueAndWhatIsAllowed) {
  EXPECT_EQ(refusal("[device]\n[motor]\nresistance = 1\n"),
            "bad.toml:2:1: motor.kind is missing; allowed is \"ideal\", \"dc\" or \"pmsm\"");
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = \"stepper\"\n"),
            "bad.toml:3:8: motor.kind = 'stepper': allowed is \"ideal\", \"dc\" or \"pmsm\"");
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = 1\n"),
            "bad.toml:3:8: motor.kind = 1: allowed is \"ideal\", \"dc\" or \"pmsm\"");
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = \"dc\"\nresistance = 0\n"),
            "bad.toml:4:14: motor.resistance = 0: allowed is a number from 0.0001 to 1000 ohm");
  EXPECT_EQ(
      refusal("[device]\n[motor]\nkind = \"dc\"\npole_pairs = 7\n"),
      "bad.toml:4:1: motor.pole_pairs = 7: unknown key; allowed here: kind, defects, resistance, inductance, "
      "torque_constant");
  EXPECT_EQ(refusal("[device]\n[axis1.device]\n[axis1.motor]\nkind = \"pmsm\"\npole_pairs = 6.5\n"),
            "bad.toml:3:1: axis1.motor.pole_pairs = 6.5: allowed is a whole number");
  EXPECT_EQ(
      refusal("[device]\n[motor]\nkind = \"pmsm\"\ninductance = 1e-3\ninductance_q = 1e-3\n"),
      "bad.toml:4:14: motor.inductance = 0.001: motor.inductance_q is given too; allowed is inductance, or "
      "inductance_d and inductance_q");
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = \"pmsm\"\ninductance = 2\n"),
            "bad.toml:4:14: motor.inductance = 2: allowed is a number from 1e-07 to 1 H");
  EXPECT_EQ(
      refusal("[device]\n[inverter]\n"),
      "bad.toml:2:1: [inverter] without a [motor] of kind \"dc\" or \"pmsm\": there is no current; add the "
      "motor, or remove the table");
  EXPECT_EQ(
      refusal("[device]\n[axis1.device]\n[axis1.current_sensor]\n"),
      "bad.toml:3:1: [axis1.current_sensor] without a [axis1.motor] of kind \"dc\" or \"pmsm\": there is no "
      "current; add the motor, or remove the table");
  EXPECT_EQ(refusal("[device]\n[supply]\nabsorbs = 1\n"),
            "bad.toml:3:11: supply.absorbs = 1: allowed is true or false");
  const std::string names =
      "\"phase_a_open\", \"phase_b_open\", \"phase_c_open\", \"phases_swapped\", \"encoder_unplugged\", "
      "\"encoder_stuck\", \"encoder_reversed\", \"encoder_slipping\", \"supply_low\", \"motor_blocked\", "
      "\"current_b_inverted\", \"current_c_inverted\"";
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = \"dc\"\ndefects = [\"smoke\"]\n"),
            "bad.toml:4:12: motor.defects = 'smoke': allowed is a list of " + names);
  EXPECT_EQ(refusal("[device]\n[motor]\nkind = \"dc\"\ndefects = 3\n"),
            "bad.toml:4:11: motor.defects = 3: allowed is a list of " + names);
  EXPECT_EQ(refusal("[device]\n[encoder]\nreversed = 1\n"),
            "bad.toml:3:12: encoder.reversed = 1: allowed is true or false");
  EXPECT_EQ(refusal("identified = \"no\"\n[device]\n"),
            "bad.toml:1:14: identified = 'no': allowed is true or false");
  EXPECT_EQ(refusal("[device]\n[encoder]\nkind = \"hall\"\n"),
            "bad.toml:3:8: encoder.kind = 'hall': allowed is \"quadrature\" or \"as5047p\"");
  EXPECT_EQ(
      refusal("[device]\n[encoder]\nindex_position = 4000\n[motor]\nkind = \"dc\"\n"),
      "bad.toml:2:1: encoder.index_position = 4000: allowed is a whole number below counts_per_turn = 4000");
}

TEST(SceneMotor, RefusesEveryKindOfNonsense) {
  for (const char* text :
       {"[device]\n[motor]\nkind = \"dc\"\nresistance = nan\n",
        "[device]\n[motor]\nkind = \"dc\"\ninductance = \"1\"\n",
        "[device]\n[motor]\nkind = \"pmsm\"\nresistance = 100\ninductance = 1e-6\n", "[device]\nmotor = 1\n",
        "[device]\n[supply]\nvoltage = -1\n", "[device]\n[supply]\ncapacitance = 0\n",
        "[device]\n[supply]\nvolt = 24\n", "[device]\n[axis1.device]\n[axis1.supply]\n",
        "[device]\n[motor]\nkind = \"dc\"\n[current_sensor]\nnoise = -1\n",
        "[device]\n[motor]\nkind = \"dc\"\n[inverter]\ndead_time = 1e-6\n",
        "[device]\n[encoder]\ndropout_probability = 1.5\n", "[device]\n[encoder]\nkind = true\n",
        "[device]\n[motor]\nkind = \"dc\"\n[encoder]\ncounts_per_turn = 16.5\n"}) {
    const std::string message = refusal(text);
    EXPECT_EQ(message.rfind("bad.toml:", 0), 0u) << text << " -> " << message;
  }
}

TEST(SceneMotor, ADriveHasNoForceLimitAndItsOwnSeed) {
  const Scene scene = scene_file("motor_axes");
  ASSERT_EQ(scene.axes.size(), 2u);
  ASSERT_EQ(scene.axes[0].device.force_limit, 3.3);
  MotorDrive drive = scene.make_drive(0), same = scene.make_drive(0), other = scene.make_drive(1);
  Supply supply = scene.make_supply();
  drive.block(true);
  for (int n = 0; n < 400; ++n) drive.advance(25e-6, {{{{false, 0.0}, {true, 0.6}, {true, 0.4}}}}, supply);
  EXPECT_GT(drive.force(), 10.0);
  EXPECT_TRUE(drive.brushed());
  EXPECT_FALSE(other.brushed());
  using Channel = CurrentSensor::Channel;
  MotorDrive first = scene.make_drive(0);
  const double pin = first.current_pin(Channel::b, true) - 0.006;
  EXPECT_EQ(pin, same.current_pin(Channel::b, true) - 0.006);
  EXPECT_NE(pin, other.current_pin(Channel::b, true) + 0.003);
  EXPECT_THROW(scene.make_drive(2), std::out_of_range);
}

// What only a calibration can find is not among the parameters of a device that has none yet.
TEST(SceneMotor, TheSuppliedDevicesToCalibrateDoNotTellTheirMotors) {
  for (const char* name : {"dc_coreless_a", "dc_coreless_b", "gimbal_a", "gimbal_b", "drone"}) {
    const Scene scene = scene_file(name);
    EXPECT_FALSE(scene.identified) << name;
    ASSERT_EQ(scene.axes.size(), 1u);
    const SceneAxis& axis = scene.axes[0];
    ASSERT_TRUE(axis.motor) << name;
    EXPECT_FALSE(axis.person) << name;
    EXPECT_TRUE(axis.defects.empty()) << name;
    EXPECT_TRUE(scene.supply) << name;
    EXPECT_GT(axis.current_sensor.noise, 0.0) << name;
    EXPECT_GT(axis.device.friction, 0.0) << name;
    EXPECT_GT(axis.device.damping, 0.0) << name;
    for (const SceneParameter& parameter : scene.parameters) {
      const bool known = parameter.name == "motor.kind" || parameter.name.rfind("supply.", 0) == 0 ||
                         parameter.name == "encoder.kind" || parameter.name == "encoder.counts_per_turn" ||
                         parameter.name == "device.transmission" || parameter.name == "current.limit" ||
                         parameter.name == "force.limit" || parameter.name == "wall.position" ||
                         parameter.name == "link.timeout";
      EXPECT_TRUE(known) << name << ": " << parameter.name;
    }
    const auto* pmsm = std::get_if<SynchronousMotorConfig>(&*axis.motor);
    // A handle at rest must not be moved by its cogging, else it has no rest.
    if (pmsm) {
      EXPECT_GT(pmsm->cogging_torque, 0.0) << name;
      EXPECT_LT(pmsm->cogging_torque / axis.encoder.transmission, axis.device.friction) << name;
    }
  }
  const auto gimbal = scene_file("gimbal_b");
  const auto salient = std::get<SynchronousMotorConfig>(*gimbal.axes[0].motor);
  EXPECT_GT(salient.inductance_q, 1.2 * salient.inductance_d);
}

// The supplied motors reach the force limit of their axis with about an ampere, and its parameters are
// theirs.
TEST(SceneMotor, TheSuppliedScenesAgreeWithTheirParameters) {
  for (const char* name : {"motor_axes", "single_motor"}) {
    const Scene scene = scene_file(name);
    const auto parameter = [&](std::size_t axis, const std::string& key) {
      for (const SceneParameter& one : scene.parameters) {
        if (one.name != (axis == 1 ? "axis1." : "") + key) continue;
        if (const auto* whole = std::get_if<std::int64_t>(&one.value)) return static_cast<double>(*whole);
        return std::get<double>(one.value);
      }
      ADD_FAILURE() << name << " lacks " << key;
      return 0.0;
    };
    for (std::size_t n = 0; n < scene.axes.size(); ++n) {
      const SceneAxis& axis = scene.axes[n];
      ASSERT_TRUE(axis.motor);
      const auto* dc = std::get_if<BrushedDcMotorConfig>(&*axis.motor);
      const auto* pmsm = std::get_if<SynchronousMotorConfig>(&*axis.motor);
      const double constant = dc ? dc->torque_constant : pmsm->torque_constant;
      EXPECT_EQ(parameter(n, "motor.resistance"), dc ? dc->resistance : pmsm->resistance);
      EXPECT_EQ(parameter(n, "motor.inductance"), dc ? dc->inductance : pmsm->inductance_q);
      EXPECT_EQ(parameter(n, "motor.torque_constant"), constant);
      EXPECT_EQ(parameter(n, "device.transmission"), axis.encoder.transmission);
      EXPECT_EQ(parameter(n, "encoder.counts_per_turn"), axis.encoder.counts_per_turn);
      if (pmsm) {
        EXPECT_EQ(parameter(n, "motor.pole_pairs"), pmsm->pole_pairs);
        EXPECT_EQ(parameter(n, "motor.electrical_offset"), pmsm->electrical_offset);
      }
      const double current = parameter(n, "force.limit") * axis.encoder.transmission / constant;
      EXPECT_GT(current, 0.5);
      EXPECT_LT(current, 1.5);
      EXPECT_EQ(axis.start.position, 0.0) << "a counter that is 0 at power-on is right";
    }
  }
}

TEST(Defect, NamesAndDefectsBelongTogether) {
  for (std::size_t n = 0; n < defect_names.size(); ++n) {
    EXPECT_EQ(static_cast<std::size_t>(defect_names[n].defect), n)
        << "the table is in the enumeration's order";
    EXPECT_EQ(name_of(defect_names[n].defect), defect_names[n].name);
    EXPECT_EQ(defect_named(defect_names[n].name), defect_names[n].defect) << "a name stands twice";
  }
  EXPECT_EQ(defect_named("phase_d_open"), std::nullopt);
  EXPECT_EQ(defect_named(""), std::nullopt);
}

}  // namespace
}  // namespace kmax::simulation::scene_motor_test
