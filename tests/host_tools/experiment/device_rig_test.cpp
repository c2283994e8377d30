// Whole experiments on a simulated board, on one axis: jitter and resolution.
#include "host_tools/experiment/device_rig.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host_tools/experiment/jitter/jitter_experiment.hpp"
#include "host_tools/experiment/resolution/resolution_experiment.hpp"
#include "tests/host_tools/experiment/device_experiment.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"

namespace kmax::experiment::device_rig_test {

using host_tools_test::thrown_message;

class JitterDevice : public DeviceExperiment {
 protected:
  JitterDevice() {
    limits = jitter_limits();
    settings.wall.window = 0.6;
    settings.touches = 1;
    settings.pairs = {*paper::jitter(0, 1), *paper::jitter(2, 3)};
  }
  JitterRun run() {
    return with_rig([&](Rig& rig) { return run_jitter(rig, settings); });
  }

  JitterSettings settings;
};

TEST_F(JitterDevice, EveryTouchIsAskedForAndMeasured) {
  // The person presses with 1 N, and against F_B as well: 5 N inside, clipped at 3.3 N with F_B, are too
  // much.
  settings.pairs = {*paper::jitter(0, 1), *paper::jitter(1, 5)};
  const JitterRun result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.results.size(), 2u);
  EXPECT_EQ(result.results[0].touches, 1u);
  EXPECT_EQ(result.results[0].aborted, 0u);
  EXPECT_LT(result.results[0].amplitude, result.results[1].amplitude);
  EXPECT_EQ(result.lost_records, 0u);
  ASSERT_EQ(person.requests.size(), 2u);
  EXPECT_CONTAINS(person.requests[0], "1 N");
  EXPECT_CONTAINS(person.requests[1], "1 N act at once, inside 6 N");
}

TEST_F(JitterDevice, ASwingTooLargeEndsATouchAndIsCounted) {
  limits.abort_amplitude = 1e-4;
  settings.pairs = {*paper::jitter(0, 7)};
  const JitterRun result = run();
  expect_disarmed_and_restored();
  EXPECT_EQ(result.results[0].aborted, 1u);
  EXPECT_EQ(result.results[0].touches, 0u);
  EXPECT_EQ(judge_jitter(result.results).claim_met(), std::nullopt);
}

TEST_F(JitterDevice, TouchesThatAreDoneSurviveAnErrorAndAreNotAskedForAgain) {
  report = [this](const std::string& text) {
    if (text.starts_with("F_B = 2 N") && forceful()) throw std::runtime_error("Ctrl-C");
  };
  open_journal(settings, RunJournal::Begin::fresh);
  EXPECT_THROW(run(), std::runtime_error);
  EXPECT_EQ(person.requests.size(), 2u);
  report = [](const std::string&) {};
  open_journal(settings, RunJournal::Begin::resume);
  const JitterRun resumed = run();
  EXPECT_EQ(person.requests.size(), 3u) << "the first pair was done";
  ASSERT_EQ(resumed.results.size(), 2u);
  EXPECT_EQ(resumed.results[0].touches, 1u);
  open_journal(settings, RunJournal::Begin::resume);
  const JitterRun again = run();
  EXPECT_EQ(person.requests.size(), 3u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.results[i].amplitude, resumed.results[i].amplitude);
    EXPECT_EQ(again.results[i].adjustment_time, resumed.results[i].adjustment_time);
  }
  EXPECT_EQ(again.limited_share, resumed.limited_share);
  settings.wall.window = 0.7;
  EXPECT_CONTAINS(thrown_message<JournalError>([&] { open_journal(settings, RunJournal::Begin::resume); }),
                  "window_s");
  expect_disarmed_and_restored();
}

// A host that cannot fetch the trace as fast as the device writes it sees gaps, and a jitter that fell into
// one was never seen.
class JitterOverASlowLink : public JitterDevice {
 protected:
  JitterOverASlowLink() {
    settings.wall.window = 2.0;
    settings.touches = 2;
    settings.pairs = {*paper::jitter(0, 1)};
    cable().before_request = [this] {
      const bool on = forceful();
      if (on && !was_on_) ++touched;
      was_on_ = on;
      // A request brings 15 records of 500 that are written in a second.
      if (on && touched <= slow_touches) cable().sim.wait(std::chrono::milliseconds(100));
    };
  }
  JitterRun run_slowly(int slow) {
    touched = 0;
    slow_touches = slow;
    return run();
  }
  int touched = 0, slow_touches = 0;

 private:
  bool was_on_ = false;
};

TEST_F(JitterOverASlowLink, ATouchWithLostRecordsIsMadeAgain) {
  const JitterResult whole = run_slowly(0).results.front();
  ASSERT_EQ(touched, 2);
  const JitterRun result = run_slowly(1);
  EXPECT_EQ(touched, 3);
  EXPECT_EQ(person.requests.size(), 5u);
  EXPECT_EQ(result.lost_records, 0u) << "of the touches that count";
  EXPECT_EQ(result.results.front().touches, 2u);
  EXPECT_EQ(result.results.front().unsettled, whole.unsettled);
  // When the wall is sampled is chance: three counts.
  EXPECT_NEAR(result.results.front().amplitude, whole.amplitude, 3 * 0.055e-3);
  EXPECT_TRUE(notices.empty());
  EXPECT_TRUE(std::any_of(reported.begin(), reported.end(), [](const std::string& text) {
    return text.find("records of its trace were lost; once more") != std::string::npos;
  }));
}

TEST_F(JitterOverASlowLink, OneThatAlwaysLosesSomeIsNotCountedAndIsTold) {
  const JitterRun result = run_slowly(touch_attempts);
  EXPECT_EQ(touched, touch_attempts + 1);
  EXPECT_EQ(result.results.front().touches, 1u) << "the second one";
  EXPECT_GT(result.lost_records, 0u);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_CONTAINS(notices[0], "touch 1 of 2: not counted, ");
}

/// Jitter at F_I = 5 N, m; the mean of touches, whose sampling instants are chance.
double served_jitter(double background, double activation_gain) {
  simulation::Scene scene = simulated_board::open_scene("paper1_jitter");
  scene.axes[0].person->activation_gain = activation_gain;
  device::Device device(std::make_unique<device::SimLink>(scene));
  JitterSettings settings;
  settings.touches = 6;
  settings.wall.window = 1.5;
  settings.pairs = {*paper::jitter(background, 5)};
  TouchLimits limits = jitter_limits();
  limits.force_limit = 20.0;
  const ReportText nobody = [](const std::string&) {};
  DeviceRig rig(device, limits, {nullptr, nullptr, nobody, nobody});
  const JitterResult result = run_jitter(rig, settings).results.front();
  EXPECT_EQ(result.touches, 6u) << "F_B = " << background << ", gamma = " << activation_gain;
  return result.amplitude;
}

// Table I by a served person: whoever stiffens with F_B is thrown out less far, and it is the stiffening that
// does it.
TEST(JitterOfAServedPerson, FallsWithTheBackgroundForceIfThePersonStiffens) {
  const double none = served_jitter(0, 0.574), three = served_jitter(3, 0.574);
  EXPECT_LT(three, 0.8 * none);
  EXPECT_GT(served_jitter(3, 0.0), 0.9 * none);
}

class ResolutionDevice : public DeviceExperiment {
 protected:
  ResolutionDevice() {
    settings.wall.hold = 1.0;
    settings.speeds = {0.1};
  }
  ResolutionTouches run() {
    return with_rig([&](Rig& rig) { return run_resolution(rig, settings); });
  }
  ResolutionSettings settings = resolution_on_device();
};

TEST_F(ResolutionDevice, EveryTouchHasItsOwnStepAndSpeed) {
  const ResolutionTouches result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.cells.size(), 3u);
  EXPECT_EQ(person.requests.size(), 3u);
  const double steps[] = {0.055e-3, 0.11e-3, 0.385e-3};  // whole counts of 0.055 mm
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.cells[i].step, steps[i], 1e-8);
    // The scene's person comes at 0.2 m/s whoever asks; the hand overtakes what it intends, by how much
    // depends on the moment.
    EXPECT_GT(result.cells[i].speed, 0.2);
    EXPECT_LT(result.cells[i].speed, 0.3);
    EXPECT_TRUE(result.cells[i].judged());
  }
  EXPECT_EQ(result.aborted, 0u);
  EXPECT_EQ(result.lost_records, 0u);
}

TEST_F(ResolutionDevice, ATouchThatSwingsTooFarIsTakenAsVibrating) {
  limits.abort_amplitude = 1e-4;
  settings.resolutions = {0.4e-3};
  const ResolutionTouches result = run();
  expect_disarmed_and_restored();
  ASSERT_EQ(result.cells.size(), 1u);
  EXPECT_EQ(result.aborted, 1u);
  EXPECT_TRUE(result.cells[0].vibrates());
}

TEST_F(ResolutionDevice, EqualTouchesAreKeptApartInTheJournal) {
  settings.speeds = {0.1, 0.1};
  settings.resolutions = {0.0};
  open_journal(settings, RunJournal::Begin::fresh);
  const ResolutionTouches made = run();
  EXPECT_EQ(journal->size(), 2u);
  open_journal(settings, RunJournal::Begin::resume);
  const ResolutionTouches again = run();
  EXPECT_EQ(person.requests.size(), 2u);
  ASSERT_EQ(again.cells.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again.cells[i].speed, made.cells[i].speed);
    EXPECT_EQ(again.cells[i].peak_to_peak, made.cells[i].peak_to_peak);
    EXPECT_EQ(again.cells[i].vibrates(), made.cells[i].vibrates());
  }
}

// The simulated hand lets go after 3 s: nobody is in the wall when it is judged.
TEST_F(ResolutionDevice, ATouchThatIsNotHeldIsMadeThreeTimes) {
  settings.wall.hold = 5.0;
  settings.resolutions = {0.0};
  const ResolutionTouches result = run();
  EXPECT_EQ(person.requests.size(), 3u);
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

}  // namespace kmax::experiment::device_rig_test
