#include "host_tools/device/trace_reader.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "firmware/capture/trace.hpp"
#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/sim/sim_link.hpp"

namespace kmax::device::trace_reader_test {

using std::chrono::milliseconds;

constexpr Parameter next_record = Parameter::of<"trace.next">();

/// A simulated device whose axis is being traced.
struct Traced {
  explicit Traced(double rate, std::size_t axis = 0, std::uint16_t interval = 1, const char* scene = nullptr)
      : device(std::make_unique<device::SimLink>(scene == nullptr ? simulated_board::factory_scene()
                                                                  : simulated_board::open_scene(scene))) {
    set<"haptic.rate">(rate, axis);
    device.link().wait(milliseconds(100));
    reader.emplace(device, axis, interval);
  }
  template <firmware::FixedName name>
  void set(double value, std::size_t axis = 0) {
    const Parameter parameter = Parameter::of<name>(axis);
    const Assignment one{parameter, firmware::raw_from_number(parameter.definition().type, value)};
    device.apply(std::span(&one, 1));
  }
  std::uint32_t records() { return device.read(next_record); }

  Device device;
  std::optional<TraceReader> reader;
};

void expect_steps(const std::vector<TraceSample>& samples, double step) {
  for (std::size_t i = 1; i < samples.size(); ++i)
    ASSERT_NEAR(samples[i].time - samples[i - 1].time, step, 1e-9) << i;
}

TEST(TraceReader, ReadOftenItHasEveryRecordAndFollowsTheTicks) {
  Traced traced(500);
  std::vector<TraceSample> samples;
  for (int i = 0; i < 100; ++i) {
    traced.device.link().wait(milliseconds(20));
    traced.reader->read(samples);
  }
  traced.reader->stop();
  traced.reader->read(samples);
  EXPECT_EQ(traced.reader->lost(), 0u);
  EXPECT_EQ(samples.size(), traced.records());
  EXPECT_GT(samples.size(), 2 * firmware::trace_capacity) << "the ring must have wrapped";
  EXPECT_EQ(samples.front().time, 0.0);
  expect_steps(samples, 1.0 / 500);
}

TEST(TraceReader, EveryFifthRecordOfTheSecondAxis) {
  Traced traced(1000, 1, 5, "two_axes");
  std::vector<TraceSample> samples;
  traced.device.link().wait(milliseconds(500));
  traced.reader->read(samples);
  traced.reader->stop();
  EXPECT_EQ(traced.reader->lost(), 0u);
  ASSERT_GT(samples.size(), 90u);
  expect_steps(samples, 5.0 / 1000);
  // The second handle of the scene lies at 5 mm, the first one at 20 mm.
  EXPECT_NEAR(samples.back().position, 0.005, 1e-4);
}

// A ring that is full to the last record has lost none; one more record is one lost.
TEST(TraceReader, AFullRingLosesNothingOneMoreLosesOne) {
  Traced traced(20000);
  traced.reader->stop();
  auto& board = dynamic_cast<device::SimLink&>(traced.device.link()).simulation().board();
  std::set<std::uint32_t> seen;
  for (std::uint32_t ticks = 440; ticks <= 520; ++ticks) {
    const std::uint32_t begin = traced.records();
    TraceReader reader(traced.device, 0);
    // Stopped by the board itself, to the tick: a record each.
    board.advance(ticks);
    board.application().preset(firmware::entry_of<"trace.interval">(), 0, 0);
    const std::uint32_t made = traced.records() - begin;
    seen.insert(made);
    std::vector<TraceSample> samples;
    reader.read(samples);
    ASSERT_EQ(samples.size(), std::min<std::size_t>(made, firmware::trace_capacity));
    ASSERT_EQ(reader.lost(), made - samples.size());
    expect_steps(samples, 1.0 / 20000);
  }
  EXPECT_TRUE(seen.contains(511) && seen.contains(512) && seen.contains(513));
}

RC_GTEST_PROP(TraceReaderProperty, GotAndLostAreWhatWasTraced, ()) {
  const double rate = *rc::gen::element(500.0, 1000.0, 4000.0, 20000.0);
  const auto interval = *rc::gen::element<std::uint16_t>(1, 1, 2, 3);
  Traced traced(rate, 0, interval);
  const double step = interval / rate;
  // Of records: from none to some more than the ring holds.
  const auto waits =
      *rc::gen::container<std::vector<int>>(rc::gen::inRange<int>(0, firmware::trace_capacity * 5 / 4));
  std::vector<TraceSample> samples;
  for (std::size_t i = 0; i < waits.size() && i < 4; ++i) {
    traced.device.link().wait(std::chrono::microseconds(std::lround(waits[i] * step * 1e6)));
    traced.reader->read(samples);
  }
  traced.reader->stop();
  traced.reader->read(samples);
  RC_ASSERT(samples.size() + traced.reader->lost() == traced.records());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // On the grid of the trace's beginning, in order, never twice.
    const double steps = samples[i].time / step;
    RC_ASSERT(std::abs(steps - std::round(steps)) < 1e-6);
    if (i > 0) RC_ASSERT(samples[i].time > samples[i - 1].time);
  }
  // The newest record is always there.
  if (!samples.empty()) RC_ASSERT(std::abs(samples.back().time / step - (traced.records() - 1)) < 1e-6);
}

TEST(TraceReader, ALateFirstReadCountsItsLossToo) {
  Traced traced(500);
  traced.device.link().wait(std::chrono::seconds(3));
  traced.reader->stop();
  std::vector<TraceSample> samples;
  traced.reader->read(samples);
  EXPECT_EQ(samples.size(), firmware::trace_capacity);
  EXPECT_EQ(samples.size() + traced.reader->lost(), traced.records());
  EXPECT_GT(traced.reader->lost(), 900u);
  EXPECT_NEAR(samples.front().time, static_cast<double>(traced.reader->lost()) / 500, 1e-9);
  expect_steps(samples, 1.0 / 500);
}

TEST(TraceReader, AnotherReaderBeginsAnew) {
  Traced traced(500);
  traced.device.link().wait(milliseconds(700));
  TraceReader second(traced.device, 0);
  std::vector<TraceSample> samples;
  const std::uint32_t before = traced.records();
  traced.device.link().wait(milliseconds(100));
  second.read(samples);
  EXPECT_EQ(second.lost(), 0u);
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(samples.front().time, 0.0);
  EXPECT_LE(samples.size(), traced.records() - before + 10u);
}

TEST(TraceReader, PositionsAndForcesAreThoseOfTheDevice) {
  Traced traced(500, 0, 1, "two_axes");
  traced.device.link().wait(milliseconds(100));
  Drive drive(traced.device, 0);
  drive.arm();
  std::vector<TraceSample> samples;
  for (int i = 0; i < 100; ++i) {
    traced.device.link().wait(milliseconds(20));
    traced.reader->read(samples);
  }
  drive.disarm();
  ASSERT_FALSE(samples.empty());
  const double length = firmware::count_length(
      dynamic_cast<device::SimLink&>(traced.device.link()).simulation().board().application().values(), 0);
  bool pushed = false;
  for (const TraceSample& sample : samples) {
    const double counts = sample.position / length;
    ASSERT_NEAR(counts, std::round(counts), 1e-6);
    // The magnetic wall of the scene: F_MC = 1 N and 3000 N/m.
    if (sample.position < 0 && sample.force > 0) pushed = true;
  }
  EXPECT_NEAR(samples.front().position, 0.02, 1e-4);
  EXPECT_TRUE(pushed);
  EXPECT_EQ(samples.back().magnetic_coefficient, 1.0);
}

}  // namespace kmax::device::trace_reader_test
