// A whole experiment on two axes of a simulated board: deviation.
#include <gtest/gtest.h>

#include "host_tools/experiment/deviation/deviation_experiment.hpp"
#include "tests/host_tools/experiment/device_experiment.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"

namespace kmax::experiment::two_axis_rig_test {

using host_tools_test::thrown_message;

class DeviationDevice : public DeviceExperiment {
 protected:
  DeviationDevice() : DeviceExperiment(two_held_axes()) {
    axes = RigAxes::wall_along;
    limits = deviation_limits();
    settings.protocol.pulses = 1;
    settings.protocol.rest = 0.4;
    settings.pairs = {*paper::deviation(0, 3)};
    // A wall on the axis along the surface would be in the way.
    set({"axis1.wall.law=none"});
    before = values();
  }
  DeviationRun run() {
    return with_rig([&](Rig& rig) { return run_deviation(rig, settings); });
  }
  DeviationSettings settings;
};

TEST(DeviationPlan, SwitchesEachPulseOnAndOff) {
  DeviationProtocol protocol;
  protocol.pulses = 2;
  const auto changes = deviation_plan(protocol, *paper::deviation(3, 5)).changes;
  ASSERT_EQ(changes.size(), 9u);
  EXPECT_EQ(changes[0].force, 5.0);
  EXPECT_EQ(changes[1].force, 0.0);
  EXPECT_DOUBLE_EQ(changes[1].time - changes[0].time, 0.5);
  EXPECT_EQ(changes[4].of, ForceChange::Of::background);
  EXPECT_EQ(changes[4].force, 3.0);
  EXPECT_DOUBLE_EQ(changes[4].time, protocol.onset());
  for (std::size_t i = 1; i < changes.size(); ++i) EXPECT_GE(changes[i].time, changes[i - 1].time);
}

TEST_F(DeviationDevice, APulseMovesTheOtherAxis) {
  const DeviationRun result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.results.size(), 1u);
  EXPECT_EQ(result.results[0].touches, 1u);
  // 3 N against the springs of grip and arm in series, 116 N/m.
  EXPECT_NEAR(result.results[0].before, 3.0 / 116.0, 2e-3);
  EXPECT_NEAR(result.results[0].deviation, 3.0 / 116.0, 2e-3);
  EXPECT_GT(result.results[0].contact_share, 0.9);
  EXPECT_EQ(result.lost_records, 0u);
  ASSERT_EQ(person.requests.size(), 1u);
}

TEST_F(DeviationDevice, ASwingTooLargeEndsATouch) {
  limits.abort_amplitude = 1e-3;
  settings.protocol.pulse_on = 0.1;  // there and back within 0.25 s
  const DeviationRun result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
}

// At 20 N/mm no hand holds the plain wall still. The axis along the surface shows nothing of it.
TEST_F(DeviationDevice, AWallThatIsUnstableEndsATouch) {
  settings.protocol.stiffness = 20e3;
  const DeviationRun result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
}

// Asked again, or, when the handle bounces on the way out, taken for an oscillation and ended: never
// averaged.
TEST_F(DeviationDevice, WhoLeavesTheWallIsNotAveraged) {
  settings.protocol.rest = 2.0;  // the simulated hand lets go after 3.6 s
  const DeviationRun result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].touches, 0u);
  EXPECT_EQ(result.results[0].aborted + result.results[0].without_contact, 1u);
  EXPECT_EQ(person.requests.size(), result.results[0].aborted == 1u ? 1u : 3u);
}

TEST_F(DeviationDevice, ATouchComesBackFromTheJournal) {
  open_journal(settings, RunJournal::Begin::fresh);
  const DeviationResult made = run().results.front();
  open_journal(settings, RunJournal::Begin::resume);
  const DeviationResult again = run().results.front();
  EXPECT_EQ(person.requests.size(), 1u);
  EXPECT_EQ(again.touches, 1u);
  EXPECT_EQ(again.deviation, made.deviation);
  EXPECT_EQ(again.contact_share, made.contact_share);
}

// F_B pushes the handle out of the hand's rest against the wall, and it swings: that is no instability.
TEST_F(DeviationDevice, ABackgroundForceOnAStableWallEndsNothing) {
  settings.pairs = {*paper::deviation(1, 3)};
  const DeviationRun result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 0u);
  EXPECT_EQ(result.results[0].touches, 1u) << result.results[0].without_contact;
}

// The wall's axis is armed last, and a hand may have come to the wall meanwhile.
TEST_F(DeviationDevice, AHandThatComesBeforeTheRecordingBeganIsAskedToGoBack) {
  come_while_arming(1);
  const DeviationRun result = run();
  expect_came_and_went("F_B = 0 N, F_I = 3 N");
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].touches, 1u);
  EXPECT_EQ(person.requests.size(), 1u);
}

DeviationRun served(const simulation::Scene& scene, const DeviationSettings& settings) {
  device::Device device(std::make_unique<device::SimLink>(scene));
  device.apply(device::parse_assignments({"axis1.wall.law=none"}));
  const ReportText nobody = [](const std::string&) {};
  DeviceRig rig(device, deviation_limits(), {nullptr, nullptr, nobody, nobody}, RigAxes::wall_along);
  return run_deviation(rig, settings);
}

/// Deviation of one pulse of 3 N along the surface at F_B = `background`, m, by one person who presses
/// against the wall harder than any F_B and keeps the handle where it is along the surface.
double served_deviation(double background, double activation_gain) {
  simulation::Scene scene = two_held_axes();
  scene.axes[0].motion->push_force = 3.0;
  scene.axes[0].motion->hold_time = 8.0;
  scene.axes[1].motion.reset();
  scene.axes[1].start.position = 0.0;
  scene.axes[1].same_person = true;
  for (simulation::SceneAxis& axis : scene.axes) axis.person->activation_gain = activation_gain;
  DeviationSettings settings;
  settings.protocol.pulses = 1;
  settings.pairs = {*paper::deviation(background, 3)};
  const DeviationResult result = served(scene, settings).results.front();
  EXPECT_EQ(result.touches, 1u) << "F_B = " << background << ", gamma = " << activation_gain;
  return result.deviation;
}

// Table II by a served person: whoever stiffens with F_B is moved less, and it is the stiffening that does
// it.
TEST(DeviationOfAServedPerson, FallsWithTheBackgroundForceIfThePersonStiffens) {
  const double none = served_deviation(0, 0.574), one = served_deviation(1, 0.574),
               two = served_deviation(2, 0.574);
  EXPECT_NEAR(none, 3.0 / 116.0, 2e-3);
  EXPECT_LT(one, 0.8 * none);
  EXPECT_LT(two, 0.8 * one);
  EXPECT_NEAR(served_deviation(2, 0.0), none, 0.05 * none);
}

// With the experiment's own protocol and limits: neither the least nor the largest forces of Table II may
// throw the scene's person out of the wall, and each touch is held to its end.
TEST(DeviationOfAServedPerson, TheSuppliedSceneHoldsForWholeTouches) {
  const simulation::Scene scene = simulated_board::open_scene("paper1_deviation");
  DeviationSettings settings;
  EXPECT_GE(scene.axes[0].motion->hold_time, settings.protocol.duration() + 1.0);
  settings.pairs = {*paper::deviation(0, 1), *paper::deviation(0, 7), *paper::deviation(4, 7)};
  const auto results = served(scene, settings).results;
  ASSERT_EQ(results.size(), 3u);
  for (const DeviationResult& result : results) {
    EXPECT_EQ(result.touches, 1u) << result.paper.background << " " << result.paper.interference;
    EXPECT_GE(result.contact_share, least_contact);
  }
  EXPECT_LT(results[0].deviation, 0.5 * results[1].deviation);
  EXPECT_LT(results[2].deviation, 0.5 * results[1].deviation);
  EXPECT_LT(results[2].deviation, 0.5 * results[2].before);
}

class DeviationDisturbed : public DeviationDevice {
 protected:
  DeviationDisturbed() {
    cable().sim.wait(std::chrono::milliseconds(2000));
    set({"force.limit=10", "axis1.force.limit=9", "link.timeout=5"});
    before = values();
    settings.pairs = {*paper::deviation(0, 3), *paper::deviation(0, 3)};
    settings.pairs[1].background = 1.0;
  }
};

TEST_F(DeviationDisturbed, IsThatOfAnUndisturbedRun) {
  const auto undisturbed = run().results;
  ASSERT_EQ(undisturbed.size(), 2u);
  for (const Stall::Of of : every_stall) {
    SCOPED_TRACE(static_cast<int>(of));
    disturb(of, 2);
    const auto disturbed = run().results;
    expect_one_repetition();
    ASSERT_EQ(disturbed.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(disturbed[i].touches, 1u);
      EXPECT_EQ(disturbed[i].aborted, 0u);
      EXPECT_NEAR(disturbed[i].deviation, undisturbed[i].deviation, 0.05 * undisturbed[i].deviation);
    }
  }
  expect_to_end_after_all([&] { run(); });
}

// The second axis is armed first, and trips with the first one; its other faults are nobody's standstill.
TEST_F(DeviationDisturbed, AFaultOfTheSecondAxisIsNotRepeated) {
  report = [&](const std::string& text) {
    if (touches == 1 && text.find(" of ") != std::string::npos)
      simulation().device().connect_encoder(1, false);
  };
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { run(); }), "axis 1 lost its force");
  EXPECT_EQ(touches, 1);
  EXPECT_TRUE(notices.empty());
  expect_disarmed_and_restored();
}

}  // namespace kmax::experiment::two_axis_rig_test
