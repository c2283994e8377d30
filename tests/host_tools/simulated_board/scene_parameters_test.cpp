#include "host_tools/simulated_board/scene_parameters.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulated_board::scene_parameters_test {

using host_tools_test::thrown_message;
using simulation::ParameterValue;
using simulation::SceneError;

std::string wrong(const std::string& name, const ParameterValue& value) {
  return check_parameter(name, value).value_or("");
}

simulation::Scene scene_with(std::vector<simulation::SceneParameter> parameters) {
  simulation::Scene scene = factory_scene();
  scene.parameters = std::move(parameters);
  return scene;
}

TEST(SceneParameters, ValuesMayBeNumbersOrTexts) {
  EXPECT_EQ(wrong("wall.stiffness", std::int64_t{5500}), "");
  EXPECT_EQ(wrong("wall.stiffness", 5500.5), "");
  EXPECT_EQ(wrong("wall.stiffness", std::string("5.5 N/mm")), "");
  EXPECT_EQ(wrong("axis1.wall.law", std::string("magnetic")), "");
  EXPECT_EQ(wrong("wall.side", std::int64_t{1}), "");
  EXPECT_EQ(wrong("wall.side", std::int64_t{-1}), "");
}

TEST(SceneParameters, WhatIsWrongIsSaid) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  EXPECT_CONTAINS(wrong("wall.stifness", 1.0), "wall.stiffness");
  EXPECT_CONTAINS(wrong("measured.position", 1.0), "can only be read");
  for (const double bad : {-1.0, 1e7, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_CONTAINS(wrong("wall.stiffness", bad), "wall.stiffness") << bad;
  EXPECT_NE(wrong("wall.stiffness", true), "");
  EXPECT_NE(wrong("wall.stiffness", std::string()), "");
  EXPECT_NE(wrong("wall.law", std::string("magentic")), "");
  EXPECT_NE(wrong("wall.side", std::int64_t{0}), "");
  EXPECT_NE(wrong("axis2.wall.law", std::string("plain")), "");
  EXPECT_NE(wrong("modbus.unit", std::numeric_limits<std::int64_t>::max()), "");
  EXPECT_NE(wrong("modbus.unit", 1.5), "");
  EXPECT_NE(wrong("", 1.0), "");
}

TEST(SceneParameters, HardwareIsKnownWithoutBeingAskedForAndMayBeOverridden) {
  simulation::Scene scene = scene_with({{"device.mass", 0.5, ""}});
  scene.axes.push_back(scene.axes[0]);
  scene.axes[1].device.mass = 0.06;
  scene.axes[1].encoder.counts_per_turn = 8192;
  const auto all = assignments_of(scene);
  EXPECT_EQ(all.size(), 6u) << "three of each axis, none twice";
  SimulatedBoard simulation(scene);
  const auto& values = simulation.board().application().values();
  EXPECT_EQ(values.real<"device.mass">(0), 0.5f);
  EXPECT_EQ(values.real<"device.mass">(1), 0.06f);
  EXPECT_EQ(values.whole<"encoder.counts_per_turn">(1), 8192u);
}

TEST(SceneParameters, RulesBetweenParametersHoldForTheSetAsAWhole) {
  const auto message = [](std::vector<simulation::SceneParameter> parameters) {
    return thrown_message<SceneError>([&] { SimulatedBoard refused(scene_with(std::move(parameters))); });
  };
  EXPECT_CONTAINS(message({{"haptic.rate", 333.0, ""}}), "[parameters] haptic.rate:");
  EXPECT_CONTAINS(
      message({{"axis1.wall.adaptive_force_min", 3.0, ""}, {"axis1.wall.adaptive_force_max", 2.0, ""}}),
      "[parameters] axis1.wall.adaptive_force_min:");
  // In an order in which a part of the set alone would break the rule.
  SimulatedBoard allowed(
      scene_with({{"wall.adaptive_force_min", 8.0, ""}, {"wall.adaptive_force_max", 9.0, ""}}));
  EXPECT_EQ(allowed.board().application().values().real<"wall.adaptive_force_min">(), 8.0f);
}

TEST(SceneParameters, ARefusedSetChangesNothing) {
  SimulatedBoard simulation(factory_scene());
  firmware::Application& application = simulation.board().application();
  EXPECT_THROW(preset(application,
                      assignments_of(scene_with({{"wall.stiffness", 7.0, ""}, {"haptic.rate", 333.0, ""}}))),
               SceneError);
  EXPECT_EQ(application.values().real<"wall.stiffness">(), 1000.0f);
  preset(application, assignments_of(scene_with({{"wall.stiffness", 7.0, ""}})));
  EXPECT_EQ(application.values().real<"wall.stiffness">(), 7.0f) << "the next set is not hindered";
}

float real(const std::vector<device::Assignment>& all, const std::string& name, float missing) {
  for (const device::Assignment& one : all) {
    if (one.parameter.name() == name) return std::bit_cast<float>(one.raw);
  }
  return missing;
}

TEST(SceneParameters, AnIdentifiedSceneTellsItsMotorAndAnotherDoesNot) {
  simulation::Scene scene = open_scene("gimbal_b");
  const auto assigned = [&](const char* name) { return real(hardware_assignments_of(scene), name, -1.0f); };
  for (const char* name : {"motor.resistance", "motor.inductance", "motor.inductance_q",
                           "motor.torque_constant", "motor.electrical_offset", "device.mass"})
    EXPECT_EQ(assigned(name), -1.0f) << name;
  EXPECT_EQ(assigned("device.transmission"), 0.015f);
  scene.identified = true;
  EXPECT_EQ(assigned("motor.resistance"), 10.402f) << "with the leg that the phase's current passes";
  EXPECT_EQ(assigned("motor.inductance"), 3.1e-3f);
  EXPECT_EQ(assigned("motor.inductance_q"), 4.35e-3f);
  EXPECT_EQ(assigned("motor.torque_constant"), 0.093f);
  EXPECT_EQ(assigned("motor.electrical_offset"), -1.3f);
  EXPECT_EQ(assigned("device.mass"), 0.085f);
  SimulatedBoard simulation(scene);
  const auto& values = simulation.board().application().values();
  EXPECT_EQ(values.whole<"motor.pole_pairs">(), 7);
  EXPECT_EQ(values.whole<"encoder.direction">(), -1);
  EXPECT_EQ(values.whole<"motor.calibrated">(), 1);
  simulation::Scene dc = open_scene("dc_coreless_b");
  EXPECT_EQ(real(identified_assignments_of(dc), "motor.resistance", 0.0f), 7.104f) << "and two legs";
  SimulatedBoard unknown(dc);
  EXPECT_EQ(unknown.board().application().values().real<"motor.resistance">(), 1.0f) << "the factory's";
  EXPECT_EQ(unknown.board().application().values().whole<"motor.calibrated">(), 0);
  EXPECT_EQ(unknown.board().application().values().whole<"encoder.direction">(), 1);
}

TEST(SceneParameters, TheKindsOfMotorAndEncoderAreKnownWithAMotorOnly) {
  simulation::Scene scene = open_scene("gimbal_a");
  scene.parameters.clear();
  SimulatedBoard simulation(scene);
  const auto& values = simulation.board().application().values();
  EXPECT_EQ((values.choice<firmware::MotorKind, "motor.kind">()), firmware::MotorKind::pmsm);
  EXPECT_EQ(values.whole<"encoder.kind">(), 1);
  EXPECT_EQ(hardware_assignments_of(open_scene("touch")).size(), 3u);
}

// Commands are no settings: a scene can neither arm nor end its own transaction.
TEST(SceneParameters, CommandsInASceneDoNotArmIt) {
  for (const char* name : {"drive.controlword", "transaction.control"}) {
    for (const std::int64_t value : {1, 2, 15}) {
      try {
        const auto scene =
            scene_with({{"wall.stiffness", 7.0, ""}, {name, value, ""}, {"wall.damping", 1.0, ""}});
        if (check_parameter(name, value)) continue;
        SimulatedBoard simulation(scene);
        simulation.board().advance(2000);
        EXPECT_NE(simulation.board().application().state(0), firmware::DriveState::operation_enabled);
        EXPECT_EQ(simulation.board().application().values().real<"wall.damping">(), 1.0f) << name << value;
      } catch (const SceneError&) {
      }
    }
  }
}

}  // namespace kmax::simulated_board::scene_parameters_test
