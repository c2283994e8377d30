#include "host_tools/simulation/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host_tools/simulation/defect.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_test {

TEST(Scene, DefaultsAreThoseOfTheModels) {
  const Scene scene = parse_scene("[device]\n", "somewhere/plain.toml");
  EXPECT_EQ(scene.name, "plain");
  EXPECT_EQ(scene.duration, 5.0);
  EXPECT_EQ(scene.seed, 1u);
  ASSERT_EQ(scene.axes.size(), 1u);
  const SceneAxis& axis = scene.axes[0];
  EXPECT_EQ(axis.device.mass, DeviceModel{}.mass);
  EXPECT_FALSE(axis.person);
  EXPECT_FALSE(axis.motion);
  EXPECT_FALSE(axis.make_handle().has_operator());
  EXPECT_NEAR(axis.encoder.count_length(), 0.055e-3, 1e-14);
  EXPECT_TRUE(scene.parameters.empty());
}

TEST(Scene, ReadsEveryPart) {
  const Scene scene = parse_scene(R"(
name = "two"
description = "text"
duration = 7
seed = 42
[device]
mass = 1            # a whole number is a number
friction = 0.2
[operator]
grip_stiffness = 600
[motion]
approach_speed = 0.3
[encoder]
counts_per_turn = 8192
transmission = 0.05
[measurement]
window = 0.5
threshold = 1e-4
[axis1.device]
start_position = 0.01
start_velocity = -0.2
[axis1.encoder]
counts_per_turn = 100
)",
                                  "two.toml");
  EXPECT_EQ(scene.name, "two");
  EXPECT_EQ(scene.description, "text");
  EXPECT_EQ(scene.duration, 7.0);
  EXPECT_EQ(scene.seed, 42u);
  EXPECT_EQ(scene.measurement.window, 0.5);
  EXPECT_EQ(scene.measurement.threshold, 1e-4);
  ASSERT_EQ(scene.axes.size(), 2u);
  EXPECT_EQ(scene.axes[0].device.mass, 1.0);
  EXPECT_EQ(scene.axes[0].device.friction, 0.2);
  EXPECT_EQ(scene.axes[0].device.damping, 0.05);
  EXPECT_EQ(scene.axes[0].person->grip_stiffness, 600.0);
  EXPECT_EQ(scene.axes[0].person->arm_stiffness, OperatorModel{}.arm_stiffness);
  EXPECT_EQ(scene.axes[0].motion->approach_speed, 0.3);
  EXPECT_EQ(scene.axes[0].start.position, 0.02);
  EXPECT_EQ(scene.axes[0].encoder.counts_per_turn, 8192.0);
  EXPECT_TRUE(scene.axes[0].make_handle().has_operator());
  EXPECT_FALSE(scene.axes[1].person);
  const CoupledHandle second = scene.axes[1].make_handle();
  EXPECT_EQ(second.position(), 0.01);
  EXPECT_EQ(second.velocity(), -0.2);
  EXPECT_EQ(scene.axes[1].encoder.counts_per_turn, 100.0);
}

TEST(Scene, ParametersKeepTheirTypesAndPlaces) {
  const Scene scene = parse_scene(
      "[device]\n[parameters]\n\"wall.stiffness\" = 5500\nwall.law = \"plain\"\nwall.damping = "
      "0.5\naxis1.force.limit = 2.0\n"
      "some.flag = true\n",
      "p.toml");
  ASSERT_EQ(scene.parameters.size(), 5u);
  const auto find = [&](const std::string& name) -> const SceneParameter& {
    for (const SceneParameter& parameter : scene.parameters) {
      if (parameter.name == name) return parameter;
    }
    throw std::runtime_error(name);
  };
  EXPECT_EQ(std::get<std::int64_t>(find("wall.stiffness").value), 5500);
  EXPECT_EQ(std::get<std::string>(find("wall.law").value), "plain");
  EXPECT_EQ(std::get<double>(find("wall.damping").value), 0.5);
  EXPECT_EQ(std::get<double>(find("axis1.force.limit").value), 2.0);
  EXPECT_EQ(std::get<bool>(find("some.flag").value), true);
  EXPECT_EQ(find("wall.stiffness").where, "p.toml:3:20");
}

TEST(Scene, TheMotionAimsAtTheWallOfTheParameters) {
  const std::string head = "[device]\n[operator]\n[motion]\nstart_position = -0.05\n";
  const Scene scene = parse_scene(head + "[parameters]\nwall.position = -0.01\nwall.side = -1\n", "w.toml");
  EXPECT_EQ(scene.axes[0].motion->wall_position, -0.01);
  EXPECT_EQ(scene.axes[0].motion->wall_side, -1.0);
  const Scene same =
      parse_scene(head + "wall_position = -0.01\nwall_side = -1\n[parameters]\nwall.position = -0.01\n", "w");
  EXPECT_EQ(same.axes[0].motion->wall_position, -0.01);
  const std::string two =
      "[device]\n[operator]\n[motion]\n[axis1.device]\n[axis1.operator]\n[axis1.motion]\n[parameters]\n";
  const Scene first = parse_scene(two + "axis0.wall.position = 0.002\n", "w.toml");
  EXPECT_EQ(first.axes[0].motion->wall_position, 0.002);
  EXPECT_EQ(first.axes[1].motion->wall_position, 0.0);
  const Scene second = parse_scene(two + "wall.position = 0.004\naxis1.wall.position = 0.001\n", "w.toml");
  EXPECT_EQ(second.axes[0].motion->wall_position, 0.004);
  EXPECT_EQ(second.axes[1].motion->wall_position, 0.001);
}

TEST(Scene, ParameterNamesAreCheckedByTheCaller) {
  const ParameterCheck check = [](const std::string& name,
                                  const ParameterValue&) -> std::optional<std::string> {
    if (name == "wall.stiffness") return std::nullopt;
    return "unknown parameter; kmax list shows all";
  };
  EXPECT_EQ(refusal("[device]\n[parameters]\nwall.stiffness = 1\n", check), "accepted");
  EXPECT_EQ(refusal("[device]\n[parameters]\nwall.stifness = 1\n", check),
            "bad.toml:3:17: parameters.wall.stifness = 1: unknown parameter; kmax list shows all");
}

TEST(Scene, AMissingFileIsNamed) {
  try {
    load_scene("/nowhere/at/all.toml");
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("/nowhere/at/all.toml: cannot be read", 0), 0u);
  }
  EXPECT_THROW(load_scene("/tmp"), SceneError);
}

TEST(Scene, TouchIsTheDefaultsOfTheModels) {
  const Scene scene = scene_file("touch");
  const SceneAxis& axis = scene.axes.at(0);
  for (const auto& field : device_fields)
    EXPECT_EQ(axis.device.*field.member, DeviceModel{}.*field.member) << field.name;
  for (const auto& field : operator_fields) {
    EXPECT_EQ((*axis.person).*field.member, OperatorModel{}.*field.member) << field.name;
  }
  for (const auto& field : motion_fields) {
    EXPECT_EQ((*axis.motion).*field.member, IntendedMotionConfig{}.*field.member) << field.name;
  }
  EXPECT_EQ(axis.encoder.count_length(), EncoderConfig{}.count_length());
}

TEST(SceneMotor, WithoutTheTablesThereIsNoMotor) {
  for (const char* name : {"touch", "free_handle", "two_axes"}) {
    const Scene scene = scene_file(name);
    EXPECT_FALSE(scene.supply);
    for (const SceneAxis& axis : scene.axes) {
      EXPECT_FALSE(axis.motor);
      EXPECT_THROW(axis.make_drive(1), std::logic_error);
    }
  }
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

TEST(SceneMotor, ADriveHasNoForceLimitAndItsOwnSeed) {
  const Scene scene = scene_file("motor_axes");
  ASSERT_EQ(scene.axes.size(), 2u);
  ASSERT_EQ(scene.axes[0].device.force_limit, 3.3);
  MotorDrive drive = scene.make_drive(0), same = scene.make_drive(0), other = scene.make_drive(1);
  Supply supply = scene.make_supply();
  drive.block(true);
  for (int n = 0; n < 400; ++n) drive.advance(25e-6, {{{{false, 0.0}, {true, 0.6}, {true, 0.4}}}}, supply);
  EXPECT_GT(drive.force(), 10.0);
  EXPECT_EQ(drive.synchronous_motor(), nullptr);
  EXPECT_NE(other.synchronous_motor(), nullptr);
  using Channel = CurrentSensor::Channel;
  MotorDrive first = scene.make_drive(0);
  const double pin = first.current_pin(Channel::b) - 0.006;
  EXPECT_EQ(pin, same.current_pin(Channel::b) - 0.006);
  EXPECT_NE(pin, other.current_pin(Channel::b) + 0.003);
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

TEST(SceneDevice, ReadsStructureDelayAndIntegrator) {
  const Scene scene = parse_scene(R"(
[device]
delay = 0.7e-3
[structure]
stiffness = 2310
damping = 0.5
handle_mass = 0.02
[axis1.device]
[axis1.structure]
[integrator]
kind = "rk4"
substeps = 40
)",
                                  "s.toml");
  EXPECT_EQ(scene.axes[0].device.delay, 0.7e-3);
  ASSERT_TRUE(scene.axes[0].device.structure);
  EXPECT_EQ(scene.axes[0].device.structure->stiffness, 2310.0);
  EXPECT_EQ(scene.axes[0].device.structure->damping, 0.5);
  EXPECT_EQ(scene.axes[0].device.structure->handle_mass, 0.02);
  EXPECT_EQ(scene.axes[1].device.delay, 0.0);
  ASSERT_TRUE(scene.axes[1].device.structure);
  EXPECT_EQ(scene.axes[1].device.structure->stiffness, StructureModel{}.stiffness);
  EXPECT_EQ(scene.integrator.kind, IntegratorKind::rk4);
  EXPECT_EQ(scene.integrator.substeps, 40.0);
  EXPECT_EQ(scene.make_handle(1).integrator().kind, IntegratorKind::rk4);
  const Scene plain = parse_scene("[device]\n", "s.toml");
  EXPECT_FALSE(plain.axes[0].device.structure);
  EXPECT_EQ(plain.integrator.kind, IntegratorKind::exact);
  EXPECT_EQ(plain.make_handle(0).integrator().kind, IntegratorKind::exact);
}

TEST(SceneDevice, EveryIntegratorByItsName) {
  for (std::size_t n = 0; n < integrator_names.size(); ++n) {
    const Scene scene = parse_scene(
        "[device]\nstart_velocity = 0.1\n[integrator]\nkind = \"" + std::string(integrator_names[n]) + "\"\n",
        "s");
    EXPECT_EQ(scene.integrator.kind, static_cast<IntegratorKind>(n));
    CoupledHandle handle = scene.make_handle(0);
    handle.advance(0.05, 0.0, 2e-3);
    // 0.1 m/s against 0.093 N of friction and 0.05 N of force.
    EXPECT_NEAR(handle.velocity(), 0.1 - 2e-3 * (0.043 + 0.05 * 0.098) / 0.045, 2e-5) << n;
  }
  const Scene fine = parse_scene("[device]\n[integrator]\nkind = \"adaptive\"\ntolerance = 1e-8\n", "s");
  EXPECT_EQ(fine.integrator.tolerance, 1e-8);
}

// The motor's side is what the shaft turns; behind a motor a structure and another integrator are parts like
// any other.
TEST(SceneDevice, AStructureAndAnIntegratorBehindAMotor) {
  const std::string text =
      "[device]\n[structure]\nstiffness = 3000\n[operator]\n[motor]\nkind = \"dc\"\n[encoder]\ntransmission "
      "= 0.01\n";
  const Scene scene = parse_scene(text, "s");
  const Scene stepped = parse_scene(text + "[integrator]\nkind = \"rk4\"\n", "s");
  MotorDrive drive = scene.make_drive(0), other = stepped.make_drive(0);
  EXPECT_EQ(other.handle().integrator().kind, IntegratorKind::rk4);
  Supply supply = scene.make_supply(), second = scene.make_supply();
  for (int n = 0; n < 4000; ++n) {
    drive.advance(25e-6, {{{{false, 0.0}, {true, 0.52}, {true, 0.48}}}}, supply);
    other.advance(25e-6, {{{{false, 0.0}, {true, 0.52}, {true, 0.48}}}}, second);
  }
  EXPECT_GT(drive.force(), 0.5);
  EXPECT_GT(std::abs(drive.handle().position() - drive.handle().tip_position()), 1e-5);
  EXPECT_DOUBLE_EQ(drive.shaft_angle(), drive.handle().position() / 0.01);
  EXPECT_NEAR(other.handle().position(), drive.handle().position(),
              1e-3 * std::abs(drive.handle().position()));
}

TEST(SceneDevice, TheSamePersonHoldsBothAxes) {
  const std::string two = "[device]\n[operator]\n[axis1.device]\n[axis1.operator]\n";
  EXPECT_FALSE(parse_scene(two, "s").axes[1].same_person);
  EXPECT_TRUE(parse_scene(two + "same_person = true\n", "s").axes[1].same_person);
}

using Words = std::vector<std::string>;

Words parts_of(const std::string& text, std::size_t axis = 0) {
  return integrated_parts(parse_scene(text, "s").axes.at(axis));
}

TEST(SceneParts, WhatIsNotNamedDoesNotAppear) {
  EXPECT_EQ(parts_of("[device]\n"), Words{"device"});
  EXPECT_EQ(parts_of("[device]\n[motor]\nkind = \"ideal\"\n[encoder]\ncounts_per_turn = 100\n"),
            Words{"device"});
  EXPECT_EQ(parts_of("[device]\n[operator]\n"), (Words{"device", "hand and arm", "activation"}));
  EXPECT_EQ(parts_of("[device]\n[operator]\nactivation_gain = 0\n"), (Words{"device", "hand and arm"}));
  EXPECT_EQ(parts_of("[device]\ndelay = 0\n"), Words{"device"});
}

TEST(SceneParts, EveryPartInItsOrder) {
  EXPECT_EQ(parts_of("[device]\ndelay = 0.5e-3\n[structure]\n[operator]\n[encoder]\nedge_noise = "
                     "0.1\ndropout_probability = 0.01\n"),
            (Words{"device", "delay of 0.5 ms", "structure", "hand and arm", "activation", "encoder noise",
                   "encoder dropouts"}));
  EXPECT_EQ(parts_of("[device]\n[axis1.device]\n[axis1.motor]\nkind = \"pmsm\"\n", 1),
            (Words{"synchronous motor", "inverter", "supply", "device"}));
  EXPECT_EQ(parts_of("[device]\n[motor]\nkind = \"dc\"\n").front(), "DC motor");
}

TEST(SceneParts, IntegratorsInWords) {
  EXPECT_EQ(to_string(IntegratorConfig{}), "exact");
  EXPECT_EQ(to_string({.kind = IntegratorKind::rk4, .substeps = 40}), "rk4, 40 substeps per 2 ms");
  EXPECT_EQ(to_string({.kind = IntegratorKind::semi_implicit_euler}),
            "semi_implicit_euler, 10 substeps per 2 ms");
  EXPECT_EQ(to_string({.kind = IntegratorKind::adaptive, .tolerance = 1e-9}), "adaptive, tolerance 1e-09");
}

}  // namespace kmax::simulation::scene_test
