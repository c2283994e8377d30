#include "host_tools/simulation/scene.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_test {
namespace {

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
  EXPECT_EQ(refusal(head + "wall_side = -1\nwall_position = 0.0\n[parameters]\nwall.position = -0.01\n"),
            "bad.toml:6:17: motion.wall_position = 0: the parameter wall.position is -0.01 (bad.toml:8:17); "
            "allowed is the "
            "same value, or none here");
  const std::string two =
      "[device]\n[operator]\n[motion]\n[axis1.device]\n[axis1.operator]\n[axis1.motion]\n[parameters]\n";
  const Scene first = parse_scene(two + "axis0.wall.position = 0.002\n", "w.toml");
  EXPECT_EQ(first.axes[0].motion->wall_position, 0.002);
  EXPECT_EQ(first.axes[1].motion->wall_position, 0.0);
  const Scene second = parse_scene(two + "wall.position = 0.004\naxis1.wall.position = 0.001\n", "w.toml");
  EXPECT_EQ(second.axes[0].motion->wall_position, 0.004);
  EXPECT_EQ(second.axes[1].motion->wall_position, 0.001);
}

TEST(Scene, RefusalsNamePlaceKeyValueAndWhatIsAllowed) {
  EXPECT_EQ(refusal("[device]\nmass = -1\n"),
            "bad.toml:2:8: device.mass = -1: allowed is a number from 0.0001 to 100 kg");
  EXPECT_EQ(refusal("[device]\nmass = \"heavy\"\n"),
            "bad.toml:2:8: device.mass = 'heavy': allowed is a number from 0.0001 to 100 kg");
  EXPECT_EQ(
      refusal("[device]\n\n  mas = 1.0\n"),
      "bad.toml:3:3: device.mas = 1.0: unknown key; allowed here: start_position, start_velocity, mass, "
      "damping, friction, force_limit, delay; did you mean mass?");
  EXPECT_EQ(
      refusal("[device]\n[operator]\ngrip = 1\n"),
      "bad.toml:3:1: operator.grip = 1: unknown key; allowed here: grip_stiffness, grip_damping, hand_mass, "
      "arm_stiffness, arm_damping, activation_gain, activation_time, push_lag");
  EXPECT_EQ(refusal("duration = 0\n[device]\n").substr(0, 59),
            "bad.toml:1:12: duration = 0: allowed is a number from 0.001");
  EXPECT_EQ(refusal("seed = -1\n[device]\n"),
            "bad.toml:1:8: seed = -1: allowed is a whole number from 0 to 2^63 - 1");
  EXPECT_EQ(refusal("device = 3\n"), "bad.toml:1:10: device = 3: allowed is a table, [device]");
  EXPECT_EQ(refusal("[device]\n[parameters]\na.b = [1, 2]\n"),
            "bad.toml:3:7: parameters.a.b = [array]: allowed is a number, a text or true/false");
  EXPECT_EQ(
      refusal("[device]\n[parameters]\na.b = 1\n\"a.b\" = 2\n").find("given twice") != std::string::npos,
      true);
  EXPECT_EQ(refusal("[axis1.device]\n"), "bad.toml:1:1: [device] is missing: every axis needs a device");
}

TEST(Scene, RefusesEveryKindOfNonsense) {
  for (const char* text : {"",
                           "[device]\nmass = nan\n",
                           "[device]\nmass = inf\n",
                           "[device]\nmass = true\n",
                           "[device]\nmass = [1]\n",
                           "[device]\n[motion]\n",
                           "[device]\n[operator]\n[motion]\nwall_side = 0.5\n",
                           "[device]\n[operator]\n[motion]\nstart_position = -1.0\n",
                           "[device]\n[operator]\n[motion]\nhold_time = 0.5\n",
                           "duration = 2.0\n[device]\n[operator]\n[motion]\n",
                           "[device]\n[axis1]\n",
                           "[device]\n[axis2.device]\n",
                           "[device]\n[axis0.device]\n",
                           "[device]\n[encoder]\ncounts_per_turn = 0\n",
                           "[device]\n[encoder]\ncounts_per_turn = 1e9\ntransmission = 1e-6\n",
                           "name = 3\n[device]\n",
                           "seed = 1.5\n[device]\n",
                           "[device]\n[measurement]\nwindow = 0\n",
                           "[device]\nstart_position = 11\n",
                           "[device]\nmass = 2024-01-01\n"}) {
    const std::string message = refusal(text);
    EXPECT_EQ(message.rfind("bad.toml:", 0), 0u) << text << " -> " << message;
  }
}

TEST(Scene, SyntaxErrorsHaveAPlace) {
  EXPECT_EQ(refusal("[device]\nmass = \n").rfind("bad.toml:2:", 0), 0u);
  EXPECT_EQ(refusal("[device]\nmass = 1\nmass = 2\n").rfind("bad.toml:3:", 0), 0u);
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

TEST(Scene, AllSuppliedScenesLoad) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(scene_folder())) {
    if (entry.path().extension() != ".toml") continue;
    const Scene scene = load_scene(entry.path().string());
    EXPECT_EQ(scene.name, entry.path().stem().string());
    ++scenes;
  }
  EXPECT_GE(scenes, 3);
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

TEST(Scene, AxisZeroByItsNameIsTheSameParameter) {
  const std::string start = "[device]\n[parameters]\n";
  const std::string both = refusal(start + "axis0.wall.position = 0.01\nwall.position = 0.02\n");
  EXPECT_TRUE(both.starts_with("bad.toml:4:")) << both;
  EXPECT_NE(both.find("given twice (also at bad.toml:3:"), std::string::npos) << both;
  EXPECT_NE(both.find("as axis0.wall.position"), std::string::npos) << both;
  EXPECT_NE(refusal(start + "wall.position = 0.02\naxis0.wall.position = 0.02\n").find("given twice"),
            std::string::npos);
  // The second axis has a wall of its own.
  EXPECT_EQ(refusal(start + "axis1.wall.position = 0.01\nwall.position = 0.02\n"), "accepted");
  EXPECT_EQ(refusal(start + "axis1.wall.position = 0.01\naxis0.wall.position = 0.02\n"), "accepted");
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

}  // namespace
}  // namespace kmax::simulation::scene_test
