#include "host_tools/experiment/deviation/deviation_device.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/experiment/two_held_axes.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::deviation_device_test {
namespace {
using host_tools_test::thrown_message;

class DeviationDevice : public testing::Test {
 protected:
  DeviationDevice() : device(std::make_unique<link::SimLink>(two_held_axes())) {
    settings.protocol.pulses = 1;
    settings.protocol.rest = 0.4;
    settings.pairs = {*paper::deviation(0, 3)};
    // A wall on the axis along the surface would be in the way.
    device.apply(device::parse_assignments({"axis1.wall.law=none"}));
    before = values();
  }
  std::vector<double> values() {
    std::vector<double> all;
    for (const char* name : {"wall.law", "wall.stiffness", "interference.mode", "interference.force",
                             "interference.background_force", "interference.onset_time", "force.limit",
                             "haptic.rate", "link.timeout"})
      for (const char* axis : {"axis0.", "axis1."})
        all.push_back(
            device.read_number(std::string(name) == "link.timeout" ? name : axis + std::string(name)));
    return all;
  }
  DeviationDeviceResult run() { return run_deviation_on_device(device, settings, &asked, tell); }
  void expect_disarmed_and_restored() {
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}})
      EXPECT_FALSE(device::Drive(device, axis).status().armed()) << axis;
    EXPECT_EQ(values(), before);
  }

  device::Device device;
  DeviationDeviceSettings settings;
  AskedPerson asked;
  Tell tell = [](const std::string&) {};
  std::vector<double> before;
};

TEST(DeviationChanges, EachPulseIsSwitchedOnAndOff) {
  DeviationProtocol protocol;
  protocol.pulses = 2;
  const auto changes = deviation_changes(protocol, 3.0, 5.0);
  ASSERT_EQ(changes.size(), 9u);
  EXPECT_EQ(changes[0].assignments.front(), "interference.force=5");
  EXPECT_EQ(changes[1].assignments.front(), "interference.force=0");
  EXPECT_DOUBLE_EQ(changes[1].time - changes[0].time, 0.5);
  EXPECT_EQ(changes[4].assignments.front(), "interference.background_force=3");
  EXPECT_DOUBLE_EQ(changes[4].time, protocol.onset());
  for (std::size_t i = 1; i < changes.size(); ++i) EXPECT_GE(changes[i].time, changes[i - 1].time);
}

TEST_F(DeviationDevice, APulseMovesTheOtherAxis) {
  const DeviationDeviceResult result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.results.size(), 1u);
  EXPECT_EQ(result.results[0].touches, 1u);
  // 3 N against the springs of grip and arm in series, 116 N/m.
  EXPECT_NEAR(result.results[0].before, 3.0 / 116.0, 2e-3);
  EXPECT_NEAR(result.results[0].deviation, 3.0 / 116.0, 2e-3);
  EXPECT_GT(result.results[0].contact_share, 0.9);
  EXPECT_EQ(result.lost_records, 0u);
  ASSERT_EQ(asked.requests.size(), 1u);
}

TEST_F(DeviationDevice, ASwingTooLargeEndsATouch) {
  settings.abort_amplitude = 1e-3;
  settings.protocol.pulse_on = 0.1;  // there and back within 0.25 s
  const DeviationDeviceResult result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
}

// At 20 N/mm no hand holds the plain wall still. The axis along the surface shows nothing of it.
TEST_F(DeviationDevice, AWallThatIsUnstableEndsATouch) {
  settings.protocol.stiffness = 20e3;
  const DeviationDeviceResult result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
}

// Asked again, or, when the handle bounces on the way out, taken for an oscillation and ended: never
// averaged.
TEST_F(DeviationDevice, WhoLeavesTheWallIsNotAveraged) {
  settings.protocol.rest = 2.0;  // the simulated hand lets go after 3.6 s
  const DeviationDeviceResult result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].touches, 0u);
  EXPECT_EQ(result.results[0].aborted + result.results[0].without_contact, 1u);
  EXPECT_EQ(asked.requests.size(), result.results[0].aborted == 1u ? 1u : 3u);
}

TEST_F(DeviationDevice, TouchesThatAreDoneSurviveAnErrorAndAreNotAskedForAgain) {
  const host_tools_test::TemporaryFolder folder;
  settings.pairs = {*paper::deviation(0, 1), *paper::deviation(0, 3)};
  const auto with_journal = [&](RunJournal::Begin begin) {
    RunJournal journal(folder / "j", journal_settings(device, settings), begin);
    return run_deviation_on_device(device, settings, &asked, tell, &journal);
  };
  tell = [this](const std::string&) {
    if (asked.requests.size() == 2) throw std::runtime_error("Ctrl-C");
  };
  EXPECT_THROW(with_journal(RunJournal::Begin::anew), std::runtime_error);
  tell = [](const std::string&) {};
  const DeviationDeviceResult resumed = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 3u) << "the first pair was done";
  const DeviationDeviceResult again = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 3u);
  ASSERT_EQ(again.results.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.results[i].touches, 1u);
    EXPECT_EQ(again.results[i].deviation, resumed.results[i].deviation);
    EXPECT_EQ(again.results[i].contact_share, resumed.results[i].contact_share);
  }
  expect_disarmed_and_restored();
}

TEST_F(DeviationDevice, GivingUpOnTheWayLeavesNothingBehind) {
  tell = [this](const std::string&) {
    if (device::Drive(device, 1).status().armed()) throw std::logic_error("enough");
  };
  EXPECT_THROW(run(), std::logic_error);
  expect_disarmed_and_restored();
}

TEST_F(DeviationDevice, BothForceLimitsAreLowered) {
  settings.force_limit = 2.0;
  std::vector<double> seen;
  tell = [&](const std::string&) { seen.push_back(device.read_number("axis1.force.limit")); };
  EXPECT_EQ(run().force_limit, 2.0);
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.front(), 2.0);
  expect_disarmed_and_restored();
}

// F_B pushes the handle out of the hand's rest against the wall, and it swings: that is no instability.
TEST_F(DeviationDevice, ABackgroundForceOnAStableWallEndsNothing) {
  settings.pairs = {*paper::deviation(1, 3)};
  const DeviationDeviceResult result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 0u);
  EXPECT_EQ(result.results[0].touches, 1u) << result.results[0].without_contact;
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
  device::Device device(std::make_unique<link::SimLink>(scene));
  device.apply(device::parse_assignments({"axis1.wall.law=none"}));
  DeviationDeviceSettings settings;
  settings.protocol.pulses = 1;
  settings.protocol.rest = 1.5;
  settings.pairs = {*paper::deviation(background, 3)};
  const DeviationResult result =
      run_deviation_on_device(device, settings, nullptr, [](const std::string&) {}).results.front();
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
  DeviationDeviceSettings settings;
  EXPECT_GE(scene.axes[0].motion->hold_time, settings.protocol.duration() + 1.0);
  settings.pairs = {*paper::deviation(0, 1), *paper::deviation(0, 7), *paper::deviation(4, 7)};
  device::Device device(std::make_unique<link::SimLink>(scene));
  const auto results = run_deviation_on_device(device, settings, nullptr, [](const std::string&) {}).results;
  ASSERT_EQ(results.size(), 3u);
  for (const DeviationResult& result : results) {
    EXPECT_EQ(result.touches, 1u) << result.paper.background << " " << result.paper.interference;
    EXPECT_GE(result.contact_share, least_contact);
  }
  EXPECT_LT(results[0].deviation, 0.5 * results[1].deviation);
  EXPECT_LT(results[2].deviation, 0.5 * results[1].deviation);
  EXPECT_LT(results[2].deviation, 0.5 * results[2].before);
}

class DeviationWithoutAPerson : public DeviationDevice {
 protected:
  DeviationWithoutAPerson() {
    simulation::Scene scene = two_held_axes();
    scene.axes[0].person.reset();
    scene.axes[0].motion.reset();
    scene.axes[0].start.position = 0.02;
    device = device::Device(std::make_unique<link::SimLink>(scene));
    before = values();
  }
};

TEST_F(DeviationWithoutAPerson, NoTouchWithinPatienceIsAnError) {
  settings.patience = 1.0;
  EXPECT_CONTAINS(thrown_message<NobodyTouched>([&] { run(); }), "nobody touched the wall within 1 s");
  expect_disarmed_and_restored();
}

}  // namespace
}  // namespace kmax::experiment::deviation_device_test
