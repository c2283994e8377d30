// The capture reader on the whole firmware: dictionary, tick, memory, line and the simulated device.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"

namespace kmax::device::capture_reader_on_simulated_board_test {
namespace {

using firmware::CaptureTrigger;
using std::chrono::seconds;

CaptureSettings settings_of(std::vector<std::string> channels, std::uint32_t samples,
                            CaptureTrigger trigger = CaptureTrigger::now) {
  CaptureSettings settings;
  settings.channels = std::move(channels);
  settings.samples = samples;
  settings.trigger = trigger;
  return settings;
}

/// What the firmware of a simulated board computed in each tick of `ticks`, by its tick number.
std::map<std::uint32_t, firmware::AxisReport> watch_ticks(link::SimLink& link, std::size_t axis, int ticks) {
  std::map<std::uint32_t, firmware::AxisReport> seen;
  auto& board = link.simulation().board();
  for (int i = 0; i < ticks; ++i) {
    board.advance(1);
    const firmware::AxisReport report = board.application().ISR_report(axis);
    seen[report.tick] = report;
  }
  return seen;
}

// Nothing may be late by a tick, or rounded on the
// way.
TEST(CaptureReaderOnSimulatedBoard, EveryValueIsWhatThatTickComputed) {
  auto owned = std::make_unique<link::SimLink>(simulated_board::open_scene("two_axes"));
  link::SimLink& link = *owned;
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
  Device device(std::make_unique<link::SimLink>(simulated_board::open_scene("two_axes")));
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
  Device device(std::make_unique<link::SimLink>(simulated_board::open_scene("dc_coreless_a")));
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

}  // namespace
}  // namespace kmax::device::capture_reader_on_simulated_board_test
