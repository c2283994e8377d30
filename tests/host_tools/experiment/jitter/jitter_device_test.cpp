#include "host_tools/experiment/jitter/jitter_device.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::jitter_device_test {
namespace {
using host_tools_test::thrown_message;

class JitterDevice : public testing::Test {
 protected:
  JitterDevice() : device(std::make_unique<link::SimLink>(simulated_board::factory_scene())) {
    settings.wall.window = 0.6;
    settings.touches = 1;
    settings.pairs = {*paper::jitter(0, 1), *paper::jitter(2, 3)};
    before = values();
  }
  std::vector<double> values() {
    std::vector<double> all;
    for (const char* name : {"wall.law", "wall.stiffness", "wall.damping", "haptic.rate",
                             "position.resolution", "interference.mode", "interference.force",
                             "interference.background_force", "force.limit", "link.timeout"})
      all.push_back(device.read_number(name));
    return all;
  }
  JitterDeviceResult run() { return run_jitter_on_device(device, settings, &asked, tell); }
  void expect_disarmed_and_restored() {
    EXPECT_FALSE(device::Drive(device, 0).status().armed());
    EXPECT_EQ(values(), before);
  }

  device::Device device;
  JitterDeviceSettings settings;
  AskedPerson asked;
  Tell tell = [](const std::string&) {};
  std::vector<double> before;
};

TEST_F(JitterDevice, EveryTouchIsAskedForAndMeasured) {
  // The person presses with 1 N, and against F_B as well: 5 N inside, clipped at 3.3 N with F_B, are too
  // much.
  settings.pairs = {*paper::jitter(0, 1), *paper::jitter(1, 5)};
  const JitterDeviceResult result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.results.size(), 2u);
  EXPECT_EQ(result.results[0].touches, 1u);
  EXPECT_EQ(result.results[0].aborted, 0u);
  EXPECT_LT(result.results[0].amplitude, result.results[1].amplitude);
  EXPECT_EQ(result.lost_records, 0u);
  ASSERT_EQ(asked.requests.size(), 2u);
  EXPECT_CONTAINS(asked.requests[0], "1 N");
  EXPECT_CONTAINS(asked.requests[1], "1 N act at once, inside 6 N");
}

TEST_F(JitterDevice, TheForceLimitIsLoweredButNeverRaised) {
  settings.pairs.resize(1);
  settings.force_limit = 1.5;
  EXPECT_EQ(run().force_limit, 1.5);
  expect_disarmed_and_restored();
  settings.force_limit = 50.0;
  EXPECT_NEAR(run().force_limit, 3.3, 1e-6);
  expect_disarmed_and_restored();
}

TEST_F(JitterDevice, ASwingTooLargeEndsATouchAndIsCounted) {
  settings.abort_amplitude = 1e-4;
  settings.pairs = {*paper::jitter(0, 7)};
  const JitterDeviceResult result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
  EXPECT_EQ(judge_jitter(result.results).claim_met(), std::nullopt);
}

TEST_F(JitterDevice, GivingUpOnTheWayLeavesNothingBehind) {
  tell = [this](const std::string&) {
    if (device::Drive(device, 0).status().armed()) throw std::logic_error("enough");
  };
  EXPECT_THROW(run(), std::logic_error);
  expect_disarmed_and_restored();
}

TEST_F(JitterDevice, TouchesThatAreDoneSurviveAnErrorAndAreNotAskedForAgain) {
  const host_tools_test::TemporaryFolder folder;
  const auto with_journal = [&](RunJournal::Begin begin) {
    RunJournal journal(folder / "j", journal_settings(device, settings), begin);
    return run_jitter_on_device(device, settings, &asked, tell, &journal);
  };
  tell = [this](const std::string& text) {
    if (text.starts_with("F_B = 2 N") && device::Drive(device, 0).status().armed())
      throw std::runtime_error("Ctrl-C");
  };
  EXPECT_THROW(with_journal(RunJournal::Begin::anew), std::runtime_error);
  EXPECT_EQ(asked.requests.size(), 2u);
  tell = [](const std::string&) {};
  const JitterDeviceResult resumed = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 3u) << "the first pair was done";
  ASSERT_EQ(resumed.results.size(), 2u);
  EXPECT_EQ(resumed.results[0].touches, 1u);
  const JitterDeviceResult again = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 3u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.results[i].amplitude, resumed.results[i].amplitude);
    EXPECT_EQ(again.results[i].adjustment_time, resumed.results[i].adjustment_time);
  }
  EXPECT_EQ(again.limited_share, resumed.limited_share);
  settings.wall.window = 0.7;
  EXPECT_CONTAINS(thrown_message<JournalError>([&] { with_journal(RunJournal::Begin::resume); }), "window_s");
  expect_disarmed_and_restored();
}

TEST_F(JitterDevice, WhoDoesNotTouchIsAskedThreeTimes) {
  simulation::Scene scene = simulated_board::factory_scene();
  scene.axes[0].person.reset();
  scene.axes[0].motion.reset();
  scene.axes[0].start.position = 0.02;
  device = device::Device(std::make_unique<link::SimLink>(scene));
  settings.patience = 0.5;
  EXPECT_THROW(run(), NobodyTouched);
  EXPECT_EQ(asked.requests.size(), 3u);
  EXPECT_THROW(run_jitter_on_device(device, settings, nullptr, tell), NobodyTouched);
}

TEST_F(JitterDevice, AStiffnessThatIsNotAllowedIsRefusedBeforeAnybodyIsAsked) {
  settings.wall.stiffness = -1.0;
  EXPECT_CONTAINS(thrown_message<device::ValueError>([&] { run(); }), "wall.stiffness");
  EXPECT_TRUE(asked.requests.empty());
  expect_disarmed_and_restored();
}

/// Jitter at F_I = 5 N, m.
double served_jitter(double background, double activation_gain) {
  simulation::Scene scene = simulated_board::open_scene("paper1_jitter");
  scene.axes[0].person->activation_gain = activation_gain;
  device::Device device(std::make_unique<link::SimLink>(scene));
  JitterDeviceSettings settings;
  settings.touches = 1;
  settings.force_limit = 20.0;
  settings.wall.window = 1.5;
  settings.pairs = {*paper::jitter(background, 5)};
  const JitterResult result =
      run_jitter_on_device(device, settings, nullptr, [](const std::string&) {}).results.front();
  EXPECT_EQ(result.touches, 1u) << "F_B = " << background << ", gamma = " << activation_gain;
  return result.amplitude;
}

// Table I by a served person: whoever stiffens with F_B is thrown out less far, and it is the stiffening that
// does it.
TEST(JitterOfAServedPerson, FallsWithTheBackgroundForceIfThePersonStiffens) {
  const double none = served_jitter(0, 0.574), three = served_jitter(3, 0.574);
  EXPECT_LT(three, 0.8 * none);
  EXPECT_GT(served_jitter(3, 0.0), 0.9 * none);
}

}  // namespace
}  // namespace kmax::experiment::jitter_device_test
