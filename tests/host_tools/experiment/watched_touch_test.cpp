#include "host_tools/experiment/watched_touch.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::watched_touch_test {
namespace {
using device::TraceSample;
using host_tools_test::thrown_message;
using simulation::ContactVerdict;

std::vector<TraceSample> path(const std::vector<double>& positions, double interval = 0.002) {
  std::vector<TraceSample> samples;
  for (const double position : positions)
    samples.push_back({static_cast<double>(samples.size()) * interval, position, 0, 0});
  return samples;
}

TEST(Oscillation, OfWhatGoesOneWayIsNone) {
  EXPECT_EQ(oscillation({}, 1.0), 0.0);
  EXPECT_EQ(oscillation(path({1.0}), 1.0), 0.0);
  EXPECT_EQ(oscillation(path({0, 1, 1, 2, 5, 9}), 1.0), 0.0);
  EXPECT_EQ(oscillation(path({9, 5, 2, 1, 1, 0}), 1.0), 0.0);
}

TEST(Oscillation, IsTheSmallerWayOfBoth) {
  EXPECT_EQ(oscillation(path({0, 5, 3}), 1.0), 2.0);
  EXPECT_EQ(oscillation(path({5, 0, 3}), 1.0), 3.0);
  EXPECT_EQ(oscillation(path({0, 5, 0, 5}), 1.0), 5.0);
  // A drift that is larger than the oscillation on it.
  EXPECT_EQ(oscillation(path({0, 3, 2, 5, 4, 7, 6}), 1.0), 1.0);
}

TEST(Oscillation, SeesTheWindowOnly) {
  const auto samples = path({0, 9, 0, 1, 0, 1, 1, 1, 1});
  EXPECT_EQ(oscillation(samples, 1.0), 9.0);
  EXPECT_EQ(oscillation(samples, 0.0101), 1.0);
  EXPECT_EQ(oscillation(samples, 0.0081), 0.0);
}

TEST(Oscillation, OfASineIsItsPeakToPeak) {
  std::vector<double> sine;
  for (int i = 0; i < 500; ++i) sine.push_back(2e-3 * std::sin(2 * std::numbers::pi * 25 * i * 0.002));
  EXPECT_NEAR(oscillation(path(sine), 0.25), 4e-3, 1e-4);
}

RC_GTEST_PROP(OscillationProperty, IsThatOfTheMirrorImageAndAtMostPeakToPeak, ()) {
  auto positions = *rc::gen::nonEmpty(rc::gen::container<std::vector<double>>(
      rc::gen::map(rc::gen::inRange(-50, 50), [](int n) { return n * 1e-4; })));
  const double here = oscillation(path(positions), 10.0);
  const auto [low, high] = std::minmax_element(positions.begin(), positions.end());
  RC_ASSERT(here >= 0.0 && here <= *high - *low);
  // By definition, over all pairs.
  double rise = 0, fall = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t j = i; j < positions.size(); ++j) {
      rise = std::max(rise, positions[j] - positions[i]);
      fall = std::max(fall, positions[i] - positions[j]);
    }
  }
  RC_ASSERT(here == std::min(rise, fall));
  for (double& position : positions) position = -position;
  RC_ASSERT(oscillation(path(positions), 10.0) == here);
  std::reverse(positions.begin(), positions.end());
  RC_ASSERT(oscillation(path(positions), 10.0) == here);
}

class Watched : public TouchedBoard {
 protected:
  Watched() {
    set({"wall.law=magnetic", "wall.stiffness=5500", "wall.magnetic_coefficient=0", "haptic.rate=500"});
    watch.name = "wall";
    watch.hold_time = 1.0;
  }
  WatchedTouch touch() { return watch_touch(device, watch, report); }
  TouchWatch watch;
};

TEST_F(Watched, AnOscillationEndsTheTouchAtOnce) {
  watch.abort_amplitude = 0.8e-3;  // this wall oscillates by 1.6 mm
  watch.hold_time = 3.0;
  const WatchedTouch ended = touch();
  expect_disarmed();
  ASSERT_TRUE(ended.aborted_at);
  EXPECT_GE(*ended.aborted_at, 0.0);
  EXPECT_LT(*ended.aborted_at, 1.0);
  EXPECT_GT(ended.aborted_amplitude, 0.8e-3);
  // What had come in when it was seen: this is how long the axis pushed on, at 115200 baud.
  EXPECT_LT(ended.samples.back().time - *ended.aborted_at, 0.12);
  const auto measure = measure_touch(ended, 3.0, 0.165e-3);
  EXPECT_EQ(measure.verdict, ContactVerdict::unstable);
  EXPECT_EQ(measure.peak_to_peak, ended.aborted_amplitude);
  EXPECT_GT(measure.deepest, 0.0);
}

TEST_F(Watched, AnAmplitudeThatIsNotReachedOrZeroEndsNothing) {
  for (const double amplitude : {0.0, 20e-3}) {
    watch.abort_amplitude = amplitude;
    const WatchedTouch whole = touch();
    EXPECT_FALSE(whole.aborted_at);
    EXPECT_GT(whole.samples.back().time, 1.0);
    EXPECT_EQ(measure_touch(whole, 1.0, 0.165e-3).verdict, ContactVerdict::unstable);
  }
}

// At 20 kHz a serial line carries a fraction of the samples; the oscillation is seen in those.
TEST_F(Watched, AFastLoopIsTracedAsDenselyAsTheLinkAllows) {
  set({"haptic.rate=20000", "wall.stiffness=1000", "wall.magnetic_coefficient=2"});
  watch.abort_amplitude = 0.2e-3;
  const WatchedTouch touched = touch();
  EXPECT_EQ(touched.lost_records, 0u);
  EXPECT_TRUE(touched.aborted_at);
  watch.abort_amplitude = 0.0;
  const WatchedTouch whole = touch();
  EXPECT_EQ(whole.lost_records, 0u);
  ASSERT_GT(whole.samples.size(), 100u);
  for (std::size_t i = 1; i < whole.samples.size(); ++i)
    ASSERT_NEAR(whole.samples[i].time - whole.samples[i - 1].time, 0.002, 1e-9);
}

// The person lets go after 3 s and moves the handle away by centimetres, while the hold is still on.
TEST_F(Watched, AHandleThatIsTakenAwayIsNoOscillation) {
  set({"wall.magnetic_coefficient=2"});
  watch.hold_time = 4.5;
  watch.abort_amplitude = 5e-3;
  const WatchedTouch left = touch();
  EXPECT_FALSE(left.aborted_at) << left.aborted_amplitude;
  EXPECT_GT(left.samples.back().position, 0.01);
  EXPECT_EQ(measure_touch(left, 4.5, 0.165e-3).verdict, ContactVerdict::no_contact);
}

TEST_F(Watched, ALostLinkEndsInAnErrorAndTheDeviceRemovesTheForce) {
  set(protective_assignments(device, 0, 3.3));
  bool forceful_then = false;
  report = [&](const std::string& text) {
    if (!text.starts_with("wall: holding")) return;
    forceful_then = forceful();
    cable().cut = true;
  };
  EXPECT_CONTAINS(thrown_message<device::LinkError>([&] { touch(); }), "the cable is gone");
  EXPECT_TRUE(forceful_then);
  EXPECT_TRUE(forceful());  // nobody can tell the device
  cable().sim.wait(std::chrono::milliseconds(1100));
  EXPECT_FALSE(forceful());
}

TEST_F(Watched, WhatIsThrownOnTheWayDisarms) {
  report = [&](const std::string& text) {
    if (text.starts_with("wall: holding")) throw std::logic_error("enough");
  };
  EXPECT_THROW(touch(), std::logic_error);
  expect_disarmed();
}

// No comparison with a NaN is ever true: the axis would stay armed for ever.
TEST_F(Watched, WhatWouldNeverEndTheTouchIsRefusedBeforeArming) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  report = [&](const std::string&) { FAIL() << "begun"; };
  for (const double bad : {nan, infinity, -1.0}) {
    for (double TouchWatch::*member :
         {&TouchWatch::hold_time, &TouchWatch::contact_patience, &TouchWatch::abort_amplitude,
          &TouchWatch::abort_window, &TouchWatch::release, &TouchWatch::trace_rate,
          &TouchWatch::wall_abort_amplitude}) {
      TouchWatch one = watch;
      one.*member = bad;
      EXPECT_NE(thrown_message<std::invalid_argument>([&] { watch_touch(device, one, report); }), "") << bad;
    }
  }
  watch.axes.clear();
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>([&] { touch(); }), "on no axis");
  expect_disarmed();
}

/// Held for 2 s at 500 Hz, deep in the wall.
WatchedTouch held() {
  WatchedTouch touch;
  for (int i = 0; i < 1100; ++i) touch.samples.push_back({0.002 * i, -1e-3, 0, 0});
  return touch;
}

TEST(MeasureTouch, WithoutEnoughOfTheRecordIsToBeMadeAgainAndNoError) {
  EXPECT_EQ(measure_touch(held(), 2.0, 0.165e-3).verdict, ContactVerdict::stable);
  WatchedTouch gap = held();
  gap.lost_records = 126;
  std::erase_if(gap.samples, [](const TraceSample& s) { return s.time > 1.499 && s.time < 1.7495; });
  const auto measure = measure_touch(gap, 2.0, 0.165e-3);
  EXPECT_EQ(measure.verdict, ContactVerdict::no_contact);
  EXPECT_EQ(measure.samples, 0u);
  EXPECT_EQ(measure_touch(WatchedTouch{}, 2.0, 0.165e-3).verdict, ContactVerdict::no_contact);
}

/// A strong hand that hardly damps: without the wall's force it shoots forward and swings back.
simulation::Scene springy_hand() {
  simulation::Scene scene = simulated_board::factory_scene();
  scene.axes[0].person->arm_damping = 0.5;
  scene.axes[0].person->activation_gain = 0.0;
  scene.axes[0].motion->hold_time = 6.0;
  scene.axes[0].motion->push_force = 3.0;
  return scene;
}

class WatchedSpringyHand : public StalledBoard {
 protected:
  WatchedSpringyHand() : StalledBoard(springy_hand()) {
    set({"wall.law=magnetic", "wall.stiffness=5500", "wall.magnetic_coefficient=2", "haptic.rate=500",
         "force.limit=3.3"});
    watch.abort_amplitude = 11e-3;
  }
  TouchWatch watch;
};

TEST_F(WatchedSpringyHand, StaysWithinItsBoundUnderForce) {
  EXPECT_EQ(watch_touch(device, watch, report).aborted_at, std::nullopt);
}

// The trace of the time in which this program stood still has a swing of 11 mm in it, after the device had
// removed the force.
TEST_F(WatchedSpringyHand, WhatItDoesAfterItsForceWasRemovedUnseenIsNoOscillation) {
  stall = {Stall::Of::program, 30, [](int) { return true; }};
  const auto what = thrown_message<base::DeviceError>([&] { watch_touch(device, watch, report); });
  EXPECT_CONTAINS(what, "lost its force during the touch: the host was silent");
  expect_disarmed();
}

// It swings by 8 mm 0.3 s after the touch; this program stands still from a little earlier on.
TEST_F(WatchedSpringyHand, WhatItDidUnderForceIsOneWhateverCameAfterwards) {
  watch.abort_amplitude = 7e-3;
  int tripped = 0;
  for (const int at_request : {18, 20, 22, 24}) {
    stall = {Stall::Of::program, at_request, [](int) { return true; }};
    try {
      if (!watch_touch(device, watch, report).aborted_at) continue;
      tripped += device.read_number("drive.error_code") == 0x8130 ? 1 : 0;
    } catch (const base::DeviceError&) {
      // The records of the swing were overwritten.
    }
    expect_disarmed();
    device::Drive(device, 0).clear();
  }
  EXPECT_GT(tripped, 0);
}

using firmware::DriveState;
using firmware::Fault;

device::DriveStatus tripped(Fault fault, float timeout = 1.0F) {
  device::DriveStatus status;
  status.statusword = firmware::statusword::base_of(DriveState::fault);
  status.error_code = firmware::text_of(fault).error_code;
  status.fault_bound = timeout;
  return status;
}

/// Looks 20 ms apart, but for one gap that begins at `gap`.
LateAbort looks_with_gap(double gap, double length) {
  LateAbort late;
  double time = 0.0;
  for (; time < gap; time += 0.02) late.looked(time);
  for (time += length; time < gap + length + 1.0; time += 0.02) late.looked(time);
  return late;
}

TEST(LateAbort, IsWhatHappenedAfterTheForceHadGone) {
  const LateAbort late = looks_with_gap(2.0, 1.5);
  const auto silent = tripped(Fault::link_silent);
  EXPECT_FALSE(late.is_late(1.0, silent));
  EXPECT_FALSE(late.is_late(2.8, silent)) << "still under force, though it was only seen afterwards";
  EXPECT_TRUE(late.is_late(3.1, silent));
  EXPECT_TRUE(late.is_late(3.6, silent));
}

TEST(LateAbort, IsCountedFromTheFirstGapThatCanHaveTripped) {
  LateAbort late = looks_with_gap(2.0, 1.5);  // to 4.5 s
  late.looked(9.0);
  EXPECT_TRUE(late.is_late(4.0, tripped(Fault::link_silent)));
}

TEST(LateAbort, MayComeInAGapBeforeTheFirstRecord) {
  LateAbort late;
  late.looked(1.4);
  EXPECT_TRUE(late.is_late(1.2, tripped(Fault::link_silent)));
  EXPECT_FALSE(late.is_late(0.5, tripped(Fault::link_silent)));
}

TEST(LateAbort, IsNoneIfTheDeviceDidNotTripForSilenceOrOnlyAfterTheLastLook) {
  const LateAbort gap = looks_with_gap(2.0, 1.5), none = looks_with_gap(2.0, 0.5);
  for (const Fault fault : {Fault::over_speed, Fault::emergency_stop, Fault::encoder})
    EXPECT_FALSE(gap.is_late(3.6, tripped(fault)));
  EXPECT_FALSE(gap.is_late(3.6, device::DriveStatus{}));
  EXPECT_FALSE(none.is_late(2.6, tripped(Fault::link_silent)));
  EXPECT_TRUE(none.is_late(2.6, tripped(Fault::link_silent, 0.4F)));
}

}  // namespace

}  // namespace kmax::experiment::watched_touch_test
