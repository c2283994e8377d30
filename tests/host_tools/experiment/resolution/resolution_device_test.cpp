#include "host_tools/experiment/resolution/resolution_device.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::resolution_device_test {
namespace {

class ResolutionDevice : public testing::Test {
 protected:
  ResolutionDevice() : device(std::make_unique<link::SimLink>(simulated_board::factory_scene())) {
    settings.wall.hold = 1.0;
    settings.speeds = {0.1};
    before = values();
  }
  std::vector<double> values() {
    std::vector<double> all;
    for (const char* name : {"wall.law", "wall.stiffness", "haptic.rate", "position.resolution",
                             "position.rounding", "interference.mode", "force.limit", "link.timeout"})
      all.push_back(device.read_number(name));
    return all;
  }
  ResolutionDeviceResult run() {
    return run_resolution_on_device(device, settings, &asked, [](const std::string&) {});
  }
  void expect_disarmed_and_restored() {
    EXPECT_FALSE(device::Drive(device, 0).status().armed());
    EXPECT_EQ(values(), before);
  }

  device::Device device;
  ResolutionDeviceSettings settings;
  AskedPerson asked;
  std::vector<double> before;
};

TEST_F(ResolutionDevice, EveryTouchHasItsOwnStepAndSpeed) {
  const ResolutionDeviceResult result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.cells.size(), 3u);
  EXPECT_EQ(asked.requests.size(), 3u);
  const double steps[] = {0.055e-3, 0.11e-3, 0.385e-3};  // whole counts of 0.055 mm
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.cells[i].step, steps[i], 1e-8);
    // The scene's person comes at 0.2 m/s whoever asks; the hand overtakes what it intends.
    EXPECT_NEAR(result.cells[i].speed, 0.22, 0.05);
    EXPECT_TRUE(result.cells[i].judged());
    EXPECT_FALSE(result.aborted[i]);
  }
  EXPECT_EQ(result.lost_records, 0u);
}

TEST_F(ResolutionDevice, ATouchThatSwingsTooFarIsTakenAsVibrating) {
  settings.abort_amplitude = 1e-4;
  settings.resolutions = {0.4e-3};
  const ResolutionDeviceResult result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.cells.size(), 1u);
  EXPECT_TRUE(result.aborted[0]);
  EXPECT_TRUE(result.cells[0].vibrates());
}

TEST_F(ResolutionDevice, WithoutAPrompterNobodyIsAsked) {
  settings.resolutions = {0.0};
  const auto result = run_resolution_on_device(device, settings, nullptr, [](const std::string&) {});
  EXPECT_EQ(result.cells.size(), 1u);
  EXPECT_TRUE(asked.requests.empty());
  expect_disarmed_and_restored();
}

TEST_F(ResolutionDevice, TouchesThatAreDoneSurviveAnErrorAndAreNotAskedForAgain) {
  const host_tools_test::TemporaryFolder folder;
  Tell tell = [](const std::string&) {};
  const auto with_journal = [&](RunJournal::Begin begin) {
    RunJournal journal(folder / "j", journal_settings(device, settings), begin);
    return run_resolution_on_device(device, settings, &asked, tell, &journal);
  };
  tell = [this](const std::string&) {
    if (asked.requests.size() == 3) throw std::runtime_error("Ctrl-C");
  };
  EXPECT_THROW(with_journal(RunJournal::Begin::anew), std::runtime_error);
  tell = [](const std::string&) {};
  const ResolutionDeviceResult resumed = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 4u) << "two of three touches were done";
  const ResolutionDeviceResult again = with_journal(RunJournal::Begin::resume);
  EXPECT_EQ(asked.requests.size(), 4u);
  ASSERT_EQ(again.cells.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(again.cells[i].speed, resumed.cells[i].speed);
    EXPECT_EQ(again.cells[i].peak_to_peak, resumed.cells[i].peak_to_peak);
    EXPECT_EQ(again.cells[i].vibrates(), resumed.cells[i].vibrates());
  }
  expect_disarmed_and_restored();
}

// The simulated hand lets go after 3 s: nobody is in the wall when it is judged.
TEST_F(ResolutionDevice, ATouchThatIsNotHeldIsMadeThreeTimes) {
  settings.wall.hold = 5.0;
  settings.resolutions = {0.0};
  const ResolutionDeviceResult result = run();
  EXPECT_EQ(asked.requests.size(), 3u);
  ASSERT_EQ(result.cells.size(), 1u);
  EXPECT_FALSE(result.cells[0].judged());
}

TEST(TouchSpeed, IsTowardsTheWallOverTheLastMoment) {
  WatchedTouch touch;
  for (int i = -50; i <= 20; ++i) {
    const double time = 0.002 * i;
    touch.samples.push_back({time, i <= 0 ? -0.3 * time : 0.0, 0.0, 0.0});
  }
  EXPECT_NEAR(touch_speed(touch), 0.3, 1e-9);
  touch.side = -1.0;
  EXPECT_NEAR(touch_speed(touch), -0.3, 1e-9);
  EXPECT_EQ(touch_speed({}), 0.0);
}

}  // namespace
}  // namespace kmax::experiment::resolution_device_test
