#include "host_tools/experiment/touch_changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "host_tools/base/errors.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::touch_changes_test {

using host_tools_test::thrown_message;
using Texts = std::vector<std::string>;

TouchSetup usual(control::WallKind law = control::WallKind::magnetic) {
  StiffnessCondition condition;
  condition.law = law;
  condition.magnetic_coefficient = 1.0;
  condition.mode = control::AdaptiveMode::latched;
  return touch_setup({}, {}, condition);
}

TouchSetup changed(const Texts& texts, control::WallKind law = control::WallKind::magnetic) {
  TouchSetup setup = usual(law);
  TouchChanges(texts, Touching::set_of_people).apply(setup);
  return setup;
}

TEST(TouchChanges, ParametersAreThoseOfTheFirmwaresLoop) {
  const TouchSetup damped = changed({"wall.damping=8"});
  EXPECT_EQ(damped.wall.wall.damping, 8.0f);
  EXPECT_EQ(damped.wall.velocity.kind, control::VelocityEstimatorKind::foaw) << "a damper needs a velocity";
  EXPECT_EQ(usual().wall.velocity.kind, control::VelocityEstimatorKind::difference);
  const TouchSetup low_pass = changed({"velocity.estimator=low_pass", "velocity.bandwidth=60Hz"});
  EXPECT_EQ(low_pass.wall.velocity.kind, control::VelocityEstimatorKind::low_pass);
  EXPECT_EQ(low_pass.wall.velocity.bandwidth, 60.0f);
  EXPECT_EQ(changed({"haptic.rate=1kHz"}).wall.tick_rate, 1000.0);
  EXPECT_EQ(changed({"wall.magnetic_length=5mm"}).wall.wall.magnetic_length, 0.005f);
  EXPECT_NEAR(changed({"position.resolution=0.4mm"}).wall.position_resolution, 0.4e-3, 1e-9);
}

TEST(TouchChanges, OfAConditionNothingIsChangedThatWasNotNamed) {
  const TouchSetup steep = changed({"wall.adaptive_velocity_max=0.18"}, control::WallKind::adaptive);
  const control::WallLawConfig<float> before = usual(control::WallKind::adaptive).wall.wall;
  EXPECT_EQ(steep.wall.wall.adaptive.velocity_max, 0.18f);
  EXPECT_EQ(steep.wall.wall.adaptive.mode, control::AdaptiveMode::latched);
  EXPECT_EQ(steep.wall.wall.adaptive.gain, before.adaptive.gain);
  EXPECT_EQ(steep.wall.wall.adaptive.force_max, before.adaptive.force_max);
  EXPECT_EQ(steep.wall.wall.adaptive.hold_time, before.adaptive.hold_time);
  EXPECT_EQ(steep.wall.wall.magnetic_coefficient, before.magnetic_coefficient);
  EXPECT_EQ(steep.wall.tick_rate, 500.0);
  EXPECT_EQ(steep.device.mass, simulation::DeviceModel{}.mass);
}

TEST(TouchChanges, DevicesAndPeopleAreThoseOfAScene) {
  const TouchSetup setup =
      changed({"device.delay=0.5ms", "structure.stiffness=2.31N/mm", "motion.start_position=100mm",
               "operator.grip_stiffness=800", "encoder.counts_per_turn=8000"});
  EXPECT_DOUBLE_EQ(setup.device.delay, 0.5e-3);
  ASSERT_TRUE(setup.device.structure);
  EXPECT_DOUBLE_EQ(setup.device.structure->stiffness, 2310.0);
  EXPECT_EQ(setup.device.structure->handle_mass, simulation::StructureModel{}.handle_mass);
  EXPECT_DOUBLE_EQ(setup.motion.start_position, 0.1);
  EXPECT_EQ(setup.person.grip_stiffness, 800.0);
  EXPECT_EQ(setup.person.hand_mass, simulation::OperatorModel{}.hand_mass);
  EXPECT_NEAR(setup.wall.count_length, 27.5e-6, 1e-9);
  EXPECT_FALSE(changed({"device.mass=60g"}).device.structure);
  EXPECT_TRUE(simulate_touch(setup).samples > 100);
}

TEST(TouchChanges, SayWhatTheyAre) {
  EXPECT_TRUE(TouchChanges().empty());
  EXPECT_EQ(TouchChanges().sentence(), "");
  EXPECT_FALSE(TouchChanges().haptic_rate());
  const TouchChanges changes({"device.delay=0.5ms", "haptic.rate=1kHz"}, Touching::simulated_person);
  EXPECT_EQ(changes.sentence(), "Changed for every touch: haptic.rate=1kHz, device.delay=0.5ms.");
  EXPECT_EQ(changes.assignments(), Texts{"haptic.rate=1kHz"});
  EXPECT_EQ(changes.haptic_rate(), 1000.0);
  EXPECT_TRUE(changes.of_simulation());
  EXPECT_DOUBLE_EQ(changes.simulated_device().axes[0].device.delay, 0.5e-3);
  EXPECT_TRUE(changes.simulated_device().parameters.empty()) << "as from the factory";
}

/// Of a name or of a value: errors of different kinds.
std::string refusal(const std::string& text, Touching touching = Touching::set_of_people) {
  try {
    TouchChanges({text}, touching);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(TouchChanges, WhatIsNotToBeChangedIsRefusedWithWhatToDo) {
  EXPECT_CONTAINS(refusal("wall.stiffness=5000"), "--start, --step and --last");
  EXPECT_CONTAINS(refusal("wall.law=plain"), "--conditions");
  EXPECT_CONTAINS(refusal("wall.adaptive_mode=instant"), "--conditions");
  EXPECT_CONTAINS(refusal("device.force_limit=2"), "--clip");
  EXPECT_CONTAINS(refusal("motion.approach_speed=0.1"), "several speeds");
  EXPECT_CONTAINS(refusal("motor.kind=dc"), "allowed are haptic.rate, wall.damping");
  EXPECT_CONTAINS(refusal("axis1.wall.damping=2"), "allowed are");
  EXPECT_CONTAINS(refusal("device.delay=1ms", Touching::device),
                  "the device that --device names is as it is");
  EXPECT_CONTAINS(refusal("parameters.device.mass=60g"), "allowed are");
  EXPECT_CONTAINS(refusal("wall.dampng=2"), "wall.damping");
}

TEST(TouchChanges, BadValuesAreRefusedWithTheRange) {
  EXPECT_CONTAINS(refusal("wall.damping=-1"), "wall.damping");
  EXPECT_CONTAINS(refusal("device.delay=2"), "from 0 to 1 s");
  EXPECT_CONTAINS(refusal("haptic.rate=333"), "divide the tick rate");
  EXPECT_CONTAINS(refusal("wall.adaptive_force_min=3"), "wall.adaptive_force_min");
  EXPECT_CONTAINS(refusal("wall.damping"), "NAME=VALUE");
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] {
                    TouchChanges({"wall.damping=1", "wall.damping=2"}, Touching::device);
                  }),
                  "given twice");
}

TEST(TouchChanges, OneSimulatedPersonHasASpeedOfTheirOwn) {
  const TouchChanges changes({"motion.approach_speed=0.1"}, Touching::simulated_person);
  EXPECT_DOUBLE_EQ(changes.simulated_device().axes[0].motion->approach_speed, 0.1);
}

TEST(WallAssignments, ChangesTakeThePlaceOfWhatTheWallSays) {
  RigWall wall;
  wall.changes = {"wall.damping=8", "velocity.estimator=difference"};
  const Texts all = wall_assignments(wall, 0, RigAxes::wall);
  EXPECT_EQ(std::count(all.begin(), all.end(), "wall.damping=8"), 1);
  EXPECT_EQ(std::count(all.begin(), all.end(), "wall.damping=0"), 0);
  EXPECT_EQ(std::count(all.begin(), all.end(), "velocity.estimator=difference"), 1);
}

TEST(TouchChanges, ALawIsChangedOnlyWhereTheExperimentDoesNotVaryIt) {
  const Texts law = {"wall.law=adaptive", "wall.adaptive_mode=latched"};
  EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { TouchChanges(law, Touching::device); }),
                  "it is what the experiment compares");
  const TouchChanges changes(law, Touching::device, Varied::stiffness_and_speeds);
  EXPECT_EQ(changes.assignments(), law);
  TouchSetup setup = usual();
  changes.apply(setup);
  EXPECT_EQ(setup.wall.wall.kind, control::WallKind::adaptive);
  EXPECT_EQ(setup.wall.wall.adaptive.mode, control::AdaptiveMode::latched);
  EXPECT_CONTAINS(thrown_message<base::ValueError>([] {
                    TouchChanges({"motion.approach_speed=1"}, Touching::simulated_person,
                                 Varied::stiffness_and_speeds);
                  }),
                  "several speeds");
}

// What somebody saved on a device must not be part of a paper's wall.
TEST(WallAssignments, LeaveNoSettingOfTheWallToTheDevice) {
  const Texts all = wall_assignments({}, 0, RigAxes::wall);
  const std::set<std::string> of_the_device{"wall.position", "wall.side", "wall.stiffness_ceiling",
                                            "wall.damping_ceiling"};
  for (const device::Parameter& parameter : device::all_parameters()) {
    const std::string name = parameter.name();
    if (!name.starts_with("wall.") && !name.starts_with("interference.")) continue;
    if (!parameter.writable() || of_the_device.contains(name)) continue;
    EXPECT_EQ(std::count_if(all.begin(), all.end(),
                            [&](const std::string& one) { return one.starts_with(name + "="); }),
              1)
        << name;
  }
}

}  // namespace kmax::experiment::touch_changes_test
