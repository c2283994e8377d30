#include "host_tools/device/capture_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numbers>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/capturing_link.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::capture_reader_test {

using firmware::CaptureChannel;
using firmware::CaptureTrigger;
using host_tools_test::CapturingLink;
using std::chrono::seconds;

/// A device that can be captured and whose contact, fault or excitation comes at a tick of one's choice.
struct Bench {
  Bench() : link(new CapturingLink), device(std::unique_ptr<device::Link>(link)) {}
  void set(std::uint32_t flags, std::uint32_t from_tick) {
    link->event_at = [flags, from_tick](std::uint32_t tick) {
      return firmware::CaptureEvent{tick >= from_tick ? flags : 0u, 0.0f, 0.0f};
    };
  }
  bool stopped() const { return !link->commands.empty() && link->commands.back() == 0; }

  CapturingLink* link;
  Device device;
};

template <typename Error, typename Call>
void expect_thrown(Call call, const std::string& part) {
  const std::string message = host_tools_test::thrown_message<Error>(call);
  EXPECT_CONTAINS(message, part);
}

CaptureSettings settings_of(std::vector<std::string> channels, std::uint32_t samples,
                            CaptureTrigger trigger = CaptureTrigger::now) {
  return CaptureSettings{.channels = std::move(channels), .samples = samples, .trigger = trigger};
}

class CaptureReaderTest : public testing::Test {
 protected:
  Bench bench;
  CaptureReader reader{bench.device};
};

TEST_F(CaptureReaderTest, GivesEachChannelInItsUnitAndEachSampleItsTick) {
  bench.device.link().wait(seconds(1));
  CaptureSettings settings =
      settings_of({"position", "force", "electrical_angle", "count"}, 100, CaptureTrigger::contact);
  settings.interval = 3;
  settings.pre_trigger = 30;
  reader.arm(settings);
  bench.set(firmware::capture_flag::inside, bench.link->tick + 500);
  reader.wait(seconds(1));
  const Captured captured = reader.read();
  ASSERT_EQ(captured.columns.size(), 4u);
  EXPECT_EQ(captured.samples(), 100u);
  EXPECT_EQ(captured.trigger_sample, 30u);
  EXPECT_EQ(captured.tick_rate, 20000.0);
  EXPECT_EQ(captured.columns[0].name, "position");
  EXPECT_EQ(captured.columns[0].unit, "m");
  EXPECT_EQ(captured.columns[1].unit, "N");
  EXPECT_EQ(captured.columns[2].unit, "rad");
  EXPECT_EQ(captured.columns[3].unit, "counts");
  // 5 cm per radian and 8192 counts per turn.
  const double count_length = 2 * std::numbers::pi * static_cast<double>(0.05f) / 8192;
  EXPECT_DOUBLE_EQ(captured.count_length, count_length);
  for (std::size_t s = 0; s < captured.samples(); ++s) {
    const std::uint32_t tick = captured.tick(s);
    ASSERT_EQ(tick, captured.first_tick + 3 * s);
    ASSERT_DOUBLE_EQ(
        captured.column("position")[s],
        static_cast<std::int32_t>(CapturingLink::word_of(tick, CaptureChannel::position)) * count_length);
    ASSERT_EQ(captured.column("force")[s], static_cast<double>(tick) + 0.5);
    ASSERT_DOUBLE_EQ(
        captured.column("electrical_angle")[s],
        CapturingLink::word_of(tick, CaptureChannel::electrical_angle) * std::numbers::pi / 2147483648.0);
    ASSERT_EQ(captured.column("count")[s], CapturingLink::word_of(tick, CaptureChannel::count));
  }
  EXPECT_EQ(captured.time(30), 0.0);
  EXPECT_DOUBLE_EQ(captured.time(0), -30 * 3 / 20000.0);
  EXPECT_DOUBLE_EQ(captured.time(99), 69 * 3 / 20000.0);
  expect_thrown<base::ValueError>([&] { captured.column("velocity"); },
                                  "position, force, electrical_angle, count");
}

TEST_F(CaptureReaderTest, AFullMemoryTakesAsFewRequestsAsTheProtocolAllows) {
  reader.arm(settings_of({"velocity", "current", "voltage"}, 0));
  reader.wait(seconds(1));
  std::uint32_t reported = 0, calls = 0;
  const Captured captured = reader.read([&](const CaptureProgress& progress) {
    EXPECT_EQ(progress.phase, CaptureProgress::Phase::reading);
    EXPECT_EQ(progress.all, 12288u);
    EXPECT_GT(progress.done, reported);
    reported = progress.done;
    ++calls;
  });
  EXPECT_EQ(captured.samples(), 4096u);
  constexpr int windows =
      (2 * 12288 + device::RegisterLink::read_count_max - 1) / device::RegisterLink::read_count_max;
  EXPECT_EQ(bench.link->window_requests, windows);
  EXPECT_EQ(static_cast<int>(calls), windows);
  EXPECT_EQ(reported, 12288u);
  EXPECT_EQ(captured.column("voltage").back(), captured.tick(4095) + 0.5);
  EXPECT_EQ(bench.link->commands, (std::vector<std::uint16_t>{1}))
      << "a complete capture need not be stopped";
}

TEST_F(CaptureReaderTest, WithoutATriggerItSaysWhichAndStopsTheCapture) {
  reader.arm(settings_of({"force"}, 10, CaptureTrigger::contact));
  const auto began = bench.link->now();
  int waiting = 0;
  expect_thrown<base::DeviceError>(
      [&] {
        reader.wait(seconds(3), [&](const CaptureProgress& progress) {
          waiting += progress.phase == CaptureProgress::Phase::waiting ? 1 : 0;
        });
      },
      "'contact' did not come within 3 s");
  EXPECT_NEAR(static_cast<double>((bench.link->now() - began).count()), 3e6, 0.1e6);
  EXPECT_GT(waiting, 50);
  EXPECT_TRUE(bench.stopped());
  bench.link->wait(seconds(1));
  EXPECT_EQ(bench.link->capture.readings().state, firmware::CaptureState::idle);

  CaptureSettings level = settings_of({"force"}, 10, CaptureTrigger::force);
  level.level = 2.5;
  reader.arm(level);
  expect_thrown<base::DeviceError>([&] { reader.wait(seconds(1)); }, "'force' above 2.5 N");
}

// The patience is for the trigger: 100 samples of 0.05 s each are waited for nevertheless.
TEST_F(CaptureReaderTest, ASlowCaptureIsWaitedForOnceItHasTriggered) {
  CaptureSettings settings = settings_of({"force"}, 100);
  settings.interval = 1000;
  reader.arm(settings);
  std::uint32_t most = 0;
  reader.wait(std::chrono::milliseconds(100), [&](const CaptureProgress& progress) {
    EXPECT_EQ(progress.all, 100u);
    most = std::max(most, progress.done);
  });
  EXPECT_GT(most, 90u);
  EXPECT_EQ(reader.read().samples(), 100u);
}

TEST_F(CaptureReaderTest, ADeviceThatFallsBehindRealTimeIsWaitedForAsLongAsItTakesSamples) {
  CaptureSettings settings = settings_of({"force"}, 100);
  settings.interval = 1000;
  reader.arm(settings);
  int looks = 0;
  reader.wait(seconds(1), [&](const CaptureProgress&) { bench.link->ticking = ++looks % 4 == 0; });
  EXPECT_EQ(reader.read().samples(), 100u);
}

TEST_F(CaptureReaderTest, AnAxisWithoutTicksIsNotWaitedForForever) {
  bench.link->ticking = false;
  reader.arm(settings_of({"force"}, 100));
  expect_thrown<base::DeviceError>([&] { reader.wait(seconds(1)); }, "did not come");
  bench.link->ticking = true;
  CaptureSettings slow = settings_of({"force"}, 100);
  slow.interval = 100;
  reader.arm(slow);
  expect_thrown<base::DeviceError>(
      [&] {
        reader.wait(seconds(1), [&](const CaptureProgress& progress) {
          if (progress.phase == CaptureProgress::Phase::running) bench.link->ticking = false;
        });
      },
      "stands still at");
}

TEST(CaptureReader, WhatTheCallbackThrowsComesThroughAndTheCaptureEnds) {
  Bench bench;
  {
    CaptureReader reader(bench.device);
    reader.arm(settings_of({"force"}, 10, CaptureTrigger::fault));
    EXPECT_THROW(reader.wait(seconds(3), [](const CaptureProgress&) { throw std::length_error("enough"); }),
                 std::length_error);
  }
  EXPECT_TRUE(bench.stopped());
}

TEST_F(CaptureReaderTest, ItsEndWithoutALinkIsQuiet) {
  reader.arm(settings_of({"force"}, 10, CaptureTrigger::fault));
  bench.link->lost = true;
}

TEST_F(CaptureReaderTest, StoppedItHasWhatWasTakenSinceTheTrigger) {
  reader.arm(settings_of({"force"}, 0));
  bench.link->wait(std::chrono::milliseconds(50));
  reader.stop();
  const Captured captured = reader.read();
  EXPECT_GT(captured.samples(), 1000u);
  EXPECT_LT(captured.samples(), 2000u);
  EXPECT_EQ(captured.column("force").front(), captured.first_tick + 0.5);
}

TEST_F(CaptureReaderTest, ACaptureThatIsNotCompleteCannotBeRead) {
  expect_thrown<base::DeviceError>([&] { reader.read(); }, "idle");
  reader.arm(settings_of({"force"}, 10, CaptureTrigger::fault));
  expect_thrown<base::DeviceError>([&] { reader.read(); }, "waiting");
}

TEST(CaptureReader, AnotherProgramMayTakeTheCaptureAwayAndThatIsSeen) {
  {
    Bench bench;
    CaptureReader reader(bench.device);
    reader.arm(settings_of({"force"}, 10, CaptureTrigger::fault));
    expect_thrown<base::DeviceError>(
        [&] { reader.wait(seconds(3), [&](const CaptureProgress&) { bench.link->capture.stop(); }); },
        "stopped by another program");
  }
  for (const bool completes : {true, false}) {
    Bench bench;
    CaptureReader reader(bench.device);
    reader.arm(settings_of({"force"}, 300));
    reader.wait(seconds(1));
    // In the middle of reading; a capture of 300 samples lasts for three requests.
    int left = completes ? 1 : 2;
    expect_thrown<base::DeviceError>(
        [&] {
          reader.read([&](const CaptureProgress&) {
            if (left-- == 1) bench.link->arm();
            if (completes) bench.link->wait(seconds(1));
          });
        },
        "another program");
  }
  Bench bench;
  CaptureReader reader(bench.device);
  reader.arm(settings_of({"force"}, 10));
  firmware::CaptureConfig wider{.channels = {CaptureChannel::force, CaptureChannel::flags}, .samples = 10};
  bench.link->capture.arm(wider);
  reader.wait(seconds(1));
  expect_thrown<base::DeviceError>([&] { reader.read(); }, "another program");
}

TEST(CaptureTriggers, GoByTheirNames) {
  for (const std::string& name : capture_trigger_names()) EXPECT_EQ(name_of(capture_trigger_of(name)), name);
  EXPECT_EQ(host_tools_test::thrown_message<base::ValueError>([] { capture_trigger_of("later"); }),
            "there is no trigger 'later'; triggers are now, contact, force, velocity, fault, excitation");
}

TEST_F(CaptureReaderTest, SettingsThatCannotBeMeantAreRefusedBeforeAnythingIsSent) {
  const int before = bench.link->requests;
  const auto refused = [&](auto change, const std::string& part) {
    CaptureSettings settings = settings_of({"force", "count"}, 100);
    change(settings);
    expect_thrown<base::ValueError>([&] { reader.arm(settings); }, part);
  };
  refused([](auto& s) { s.channels = {}; }, "0 channels");
  refused([](auto& s) { s.channels.resize(5, "force"); }, "5 channels");
  refused([](auto& s) { s.channels = {"force", "count", "force"}; }, "force is named twice");
  refused([](auto& s) { s.channels = {"forse"}; }, "did you mean force");
  refused([](auto& s) { s.channels = {"none"}; }, "no channel 'none'");
  refused([](auto& s) { s.samples = 6145; }, "at most 6144");
  refused([](auto& s) { s.pre_trigger = 100; }, "at most 99");
  refused([](auto& s) { s.samples = 0, s.pre_trigger = 6144; }, "at most 6143");
  refused([](auto& s) { s.axis = 2; }, "capture.axis");
  refused([](auto& s) { s.interval = 0; }, "capture.interval");
  refused([](auto& s) { s.level = -1; }, "capture.trigger_level");
  refused([](auto& s) { s.level = std::numeric_limits<double>::quiet_NaN(); }, "capture.trigger_level");
  EXPECT_EQ(bench.link->requests, before);
}

TEST_F(CaptureReaderTest, ADeviceThatRefusesSaysWhy) {
  bench.link->refuses = true;
  expect_thrown<base::DeviceError>([&] { reader.arm(settings_of({"force"}, 10)); }, "could not be armed");
}

TEST(CaptureChannels, HaveUnitsAndNoneIsNotOne) {
  EXPECT_EQ(capture_channel_names().size(), firmware::capture_channel_count - 1);
  EXPECT_EQ(capture_channel_unit("velocity"), "m/s");
  EXPECT_EQ(capture_channel_unit("duty_a"), "");
  expect_thrown<base::ValueError>([&] { capture_channel_unit("dutty_a"); }, "duty_a");
}

/// What the firmware of a simulated board computed in each tick of `ticks`, by its tick number.
std::map<std::uint32_t, firmware::AxisReport> watch_ticks(device::SimLink& link, std::size_t axis,
                                                          int ticks) {
  std::map<std::uint32_t, firmware::AxisReport> seen;
  auto& board = link.simulation().board();
  for (int i = 0; i < ticks; ++i) {
    board.advance(1);
    const firmware::AxisReport report = board.application().ISR_report(axis);
    seen[report.tick] = report;
  }
  return seen;
}

// On the whole firmware: dictionary, tick, memory, line and the simulated device. Nothing may be late by a
// tick, or rounded on the way.
TEST(CaptureReaderOnSimulatedBoard, EveryValueIsWhatThatTickComputed) {
  auto owned = std::make_unique<device::SimLink>(simulated_board::open_scene("two_axes"));
  device::SimLink& link = *owned;
  Device device(std::move(owned));
  link.wait(seconds(1));
  CaptureReader reader(device);
  Drive drive(device, 0);
  drive.arm();
  CaptureSettings settings =
      settings_of({"position", "velocity", "force", "distance"}, 2000, CaptureTrigger::contact);
  settings.pre_trigger = 400;
  settings.interval = 2;
  reader.arm(settings);
  const auto seen = watch_ticks(link, 0, 40000);
  reader.wait(seconds(1));
  drive.disarm();
  const Captured captured = reader.read();
  ASSERT_EQ(captured.samples(), 2000u);
  ASSERT_EQ(captured.trigger_sample, 400u);
  bool moved = false, pushed = false;
  for (std::size_t s = 0; s < captured.samples(); ++s) {
    const auto report = seen.find(captured.tick(s));
    ASSERT_NE(report, seen.end()) << s;
    const auto& haptic = report->second.haptic;
    ASSERT_EQ(captured.column("position")[s],
              static_cast<double>(static_cast<std::int32_t>(haptic.position)) * captured.count_length);
    ASSERT_EQ(captured.column("velocity")[s], static_cast<double>(haptic.velocity));
    ASSERT_EQ(captured.column("force")[s], static_cast<double>(haptic.force));
    ASSERT_EQ(captured.column("distance")[s], static_cast<double>(haptic.outside_distance));
    moved = moved || haptic.velocity < -0.01f;
    pushed = pushed || haptic.force > 0.1f;
  }
  EXPECT_TRUE(moved && pushed);
  EXPECT_GT(captured.column("distance")[399], 0.0);
  EXPECT_LE(captured.column("distance")[400], 0.0);
}

TEST(CaptureReaderOnSimulatedBoard, ArmingWithoutReadingLeavesTheNextOneFree) {
  Device device(std::make_unique<device::SimLink>(simulated_board::open_scene("two_axes")));
  {
    CaptureReader forgotten(device);
    forgotten.arm(settings_of({"count"}, 10, CaptureTrigger::fault));
  }
  CaptureReader reader(device);
  CaptureSettings settings = settings_of({"count", "flags"}, 0);
  settings.axis = 1;
  reader.arm(settings);
  reader.wait(seconds(1));
  const Captured captured = reader.read();
  EXPECT_EQ(captured.samples(), 6144u);
  // The second handle of the scene lies at 5 mm.
  EXPECT_NEAR(captured.column("count").back() * captured.count_length, 0.005, 1e-4);
}

// The square wave of voltage begins in the trigger's own tick, and the winding's current follows it.
TEST(CaptureReaderOnSimulatedBoard, AnExcitationIsSeenFromItsFirstTick) {
  Device device(std::make_unique<device::SimLink>(simulated_board::open_scene("dc_coreless_a")));
  device.link().wait(seconds(1));
  device.apply(parse_assignments({"drive.mode=excitation", "excitation.kind=voltage", "excitation.bias=1.5",
                                  "excitation.ramp=0", "excitation.duration=0.5", "excitation.travel=0.2"}));
  CaptureReader reader(device);
  CaptureSettings settings =
      settings_of({"voltage", "current", "supply", "flags"}, 600, CaptureTrigger::excitation);
  settings.pre_trigger = 100;
  reader.arm(settings);
  device.link().wait(std::chrono::milliseconds(50));
  Drive drive(device, 0);
  drive.arm();
  device.apply(parse_assignments({"excitation.run=1"}));
  reader.wait(seconds(2));
  drive.disarm();
  const Captured captured = reader.read();
  ASSERT_EQ(captured.samples(), 600u);
  ASSERT_EQ(captured.trigger_sample, 100u);
  const auto& voltage = captured.column("voltage");
  const auto& current = captured.column("current");
  const auto& flags = captured.column("flags");
  for (std::size_t s = 0; s < 600; ++s) {
    const bool on = s >= 100;
    ASSERT_NEAR(voltage[s], on ? 1.5 : 0.0, 0.01) << s;
    const auto bits = static_cast<std::uint32_t>(flags[s]);
    ASSERT_EQ((bits & firmware::capture_flag::excitation_started) != 0, s == 100) << s;
    ASSERT_NE(bits & firmware::capture_flag::armed, 0u) << s;
    ASSERT_EQ(bits & firmware::capture_flag::fault, 0u) << s;
    ASSERT_NEAR(captured.column("supply")[s], 24.0, 0.5) << s;
    // The voltage acts half a tick after the sample.
    if (s <= 100) {
      ASSERT_NEAR(current[s], 0.0, 0.1) << s;
    }
  }
  const double most = *std::max_element(current.begin(), current.end());
  EXPECT_GT(most, 0.8 * 1.5 / 2.3);
  EXPECT_LT(most, 1.2 * 1.5 / 2.3);
}

}  // namespace kmax::device::capture_reader_test
