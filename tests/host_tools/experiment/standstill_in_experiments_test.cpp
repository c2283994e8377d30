// The experiments of paper 2 on a device, with a standstill in one of their touches (standstill.hpp).
#include <gtest/gtest.h>

#include "host_tools/experiment/deviation/deviation_device.hpp"
#include "host_tools/experiment/jitter/jitter_device.hpp"
#include "host_tools/experiment/resolution/resolution_device.hpp"
#include "tests/host_tools/experiment/asked_person.hpp"
#include "tests/host_tools/experiment/stalled_board.hpp"
#include "tests/host_tools/experiment/two_held_axes.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::standstill_in_experiments_test {
namespace {
using host_tools_test::thrown_message;

class DisturbedExperiment : public StalledBoard {
 protected:
  DisturbedExperiment() : StalledBoard(two_held_axes()) {
    cable().sim.wait(std::chrono::milliseconds(2000));
    set({"force.limit=10", "axis1.force.limit=9", "link.timeout=5", "axis1.wall.law=none"});
    jitter.wall.window = 1.0;
    jitter.touches = 2;
    jitter.pairs = {*paper::jitter(0, 1)};
    resolution.wall.hold = 1.0;
    resolution.speeds = {0.1};
    resolution.resolutions.resize(2);
    deviation.protocol.pulses = 1;
    deviation.protocol.rest = 0.4;
    deviation.pairs = {*paper::deviation(0, 3), *paper::deviation(0, 3)};
    deviation.pairs[1].background = 1.0;
  }

  JitterResult run_jitter() {
    return run_jitter_on_device(device, jitter, &person, tell, nullptr, notice).results.front();
  }
  std::vector<ResolutionCell> run_resolution() {
    return run_resolution_on_device(device, resolution, &person, tell, nullptr, notice).cells;
  }
  std::vector<DeviationResult> run_deviation() {
    return run_deviation_on_device(device, deviation, &person, tell, nullptr, notice).results;
  }

  void disturb(Stall::Of of, int touch) {
    stall = {of, 30, [touch](int number) { return number == touch; }};
    touches = 0;
    notices.clear();
    person.requests.clear();
  }
  /// Two touches, one of which was made twice, and the person was asked for all three.
  void expect_one_repetition() {
    EXPECT_EQ(touches, 3);
    EXPECT_EQ(person.requests.size(), 3u);
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_CONTAINS(notices[0], "thrown away");
    expect_left_in_order();
  }
  void expect_left_in_order() {
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}})
      EXPECT_FALSE(device::Drive(device, axis).status().armed()) << axis;
    EXPECT_EQ(device.read_number("force.limit"), 10.0);
    EXPECT_EQ(device.read_number("axis1.force.limit"), 9.0);
    EXPECT_EQ(device.read_number("link.timeout"), 5.0);
  }
  void expect_to_end_after_all(const std::function<void()>& run) {
    stall = {Stall::Of::program, 30, [](int) { return true; }};
    touches = 0;
    notices.clear();
    EXPECT_CONTAINS(thrown_message<device::DeviceError>(run), "the host was silent");
    EXPECT_EQ(touches, 1 + most_standstills);
    EXPECT_EQ(notices.size(), static_cast<std::size_t>(most_standstills));
    expect_left_in_order();
  }

  JitterDeviceSettings jitter;
  ResolutionDeviceSettings resolution;
  DeviationDeviceSettings deviation;
  AskedPerson person;
  std::vector<std::string> notices;
  const Tell notice = [this](const std::string& text) { notices.push_back(text); };
};

constexpr Stall::Of every_stall[] = {Stall::Of::program, Stall::Of::link, Stall::Of::device};

TEST_F(DisturbedExperiment, JitterIsThatOfAnUndisturbedRun) {
  const JitterResult undisturbed = run_jitter();
  ASSERT_EQ(undisturbed.touches, 2u);
  for (const Stall::Of of : every_stall) {
    SCOPED_TRACE(static_cast<int>(of));
    disturb(of, 1);
    const JitterResult disturbed = run_jitter();
    expect_one_repetition();
    EXPECT_EQ(disturbed.touches, 2u);
    EXPECT_EQ(disturbed.aborted, 0u);
    EXPECT_NEAR(disturbed.amplitude, undisturbed.amplitude, 0.05 * undisturbed.amplitude);
  }
  expect_to_end_after_all([&] { run_jitter(); });
}

TEST_F(DisturbedExperiment, ResolutionIsThatOfAnUndisturbedRun) {
  const auto undisturbed = run_resolution();
  ASSERT_EQ(undisturbed.size(), 2u);
  for (const Stall::Of of : every_stall) {
    SCOPED_TRACE(static_cast<int>(of));
    disturb(of, 2);
    const auto disturbed = run_resolution();
    expect_one_repetition();
    ASSERT_EQ(disturbed.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(disturbed[i].step, undisturbed[i].step);
      EXPECT_EQ(disturbed[i].unstable, undisturbed[i].unstable);
      EXPECT_EQ(disturbed[i].without_contact, 0);
      EXPECT_NEAR(disturbed[i].speed, undisturbed[i].speed, 0.05);
    }
  }
  expect_to_end_after_all([&] { run_resolution(); });
}

TEST_F(DisturbedExperiment, DeviationIsThatOfAnUndisturbedRun) {
  const auto undisturbed = run_deviation();
  ASSERT_EQ(undisturbed.size(), 2u);
  for (const Stall::Of of : every_stall) {
    SCOPED_TRACE(static_cast<int>(of));
    disturb(of, 2);
    const auto disturbed = run_deviation();
    expect_one_repetition();
    ASSERT_EQ(disturbed.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(disturbed[i].touches, 1u);
      EXPECT_EQ(disturbed[i].aborted, 0u);
      EXPECT_NEAR(disturbed[i].deviation, undisturbed[i].deviation, 0.05 * undisturbed[i].deviation);
    }
  }
  expect_to_end_after_all([&] { run_deviation(); });
}

// The second axis is armed first, and trips with the first one; its other faults are nobody's standstill.
TEST_F(DisturbedExperiment, AFaultOfTheSecondAxisIsNotRepeated) {
  tell = [&](const std::string& text) {
    if (touches == 1 && text.find(" of ") != std::string::npos)
      simulation().device().connect_encoder(1, false);
  };
  EXPECT_CONTAINS(thrown_message<device::DeviceError>([&] { run_deviation(); }), "axis 1 lost its force");
  EXPECT_EQ(touches, 1);
  EXPECT_TRUE(notices.empty());
  expect_left_in_order();
}

}  // namespace
}  // namespace kmax::experiment::standstill_in_experiments_test
