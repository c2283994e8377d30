#include "firmware/capture/capture.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace kmax::firmware::capture_test {
namespace {

using enum CaptureChannel;

/// A capture and the ticks of its axis. In tick t every channel c holds the word 1000 t + c.
struct Bench {
  explicit Bench(std::size_t words) : storage(words, 0xDEADBEEFu), capture(storage) {}

  static std::uint32_t word_of(std::uint32_t tick, CaptureChannel channel) {
    return 1000 * tick + static_cast<std::uint32_t>(channel);
  }
  /// True: this tick was recorded.
  bool tick(const CaptureEvent& event = {}, std::size_t axis = 0) {
    bool filled = false;
    if (capture.ISR_wants(axis)) {
      capture.ISR_record(now, event, [&](CaptureSource& source) {
        filled = true;
        source.set<count>(static_cast<std::int32_t>(word_of(now, count)));
        source.set<flags>(word_of(now, flags));
        source.set<electrical_angle>(word_of(now, electrical_angle));
        source.set<position>(static_cast<std::int32_t>(word_of(now, position)));
      });
    }
    ++now;
    return filled;
  }
  void ticks(std::uint32_t number, const CaptureEvent& event = {}) {
    for (std::uint32_t i = 0; i < number; ++i) tick(event);
  }
  std::uint32_t word(std::uint32_t number) const {
    const auto address = static_cast<std::uint16_t>(0x5000 + 2 * number);
    return std::uint32_t{capture.word_at(address)} << 16 |
           capture.word_at(static_cast<std::uint16_t>(address + 1));
  }
  CaptureState state() const { return capture.readings().state; }

  /// Sample s stands where the readings say, for each of these channels, and nothing after the last.
  void expect_words(const std::vector<CaptureChannel>& channels, std::uint32_t interval) const {
    const CaptureReadings readings = capture.readings();
    ASSERT_EQ(readings.state, CaptureState::complete);
    ASSERT_EQ(readings.channels, channels.size());
    std::uint32_t w = 0;
    for (std::uint32_t s = 0; s < readings.taken; ++s) {
      for (const CaptureChannel channel : channels)
        ASSERT_EQ(word(w++), word_of(readings.first_tick + s * interval, channel)) << "sample " << s;
    }
    for (std::uint32_t i = 0; i < 8; ++i) ASSERT_EQ(word(w + i), 0u);
  }

  std::vector<std::uint32_t> storage;
  Capture capture;
  std::uint32_t now = 100;
};

CaptureConfig config_of(CaptureTrigger trigger, std::uint32_t samples, std::uint32_t pre_trigger = 0,
                        std::uint32_t interval = 1) {
  CaptureConfig config;
  config.channels = {count, none, flags, none};
  config.interval = interval;
  config.samples = samples;
  config.pre_trigger = pre_trigger;
  config.trigger = trigger;
  return config;
}

constexpr CaptureEvent inside{capture_flag::inside, 0.0f, 0.0f};
constexpr CaptureEvent faulty{3u << capture_flag::fault_shift, 0.0f, 0.0f};

TEST(Capture, WindowIsWhereTheProtocolSaysAndNowhereElse) {
  EXPECT_FALSE(Capture::contains(0x4FFF));
  EXPECT_TRUE(Capture::contains(0x5000));
  EXPECT_TRUE(Capture::contains(0xAFFF));
  EXPECT_FALSE(Capture::contains(0xB000));
  EXPECT_FALSE(Capture::contains(0x15000));
}

TEST(Capture, IdleItWantsNothing) {
  Bench bench(64);
  EXPECT_FALSE(bench.capture.ISR_wants(0));
  EXPECT_FALSE(bench.capture.ISR_wants(1));
  EXPECT_EQ(bench.state(), CaptureState::idle);
  EXPECT_FALSE(bench.capture.readable());
  bench.capture.stop();
  EXPECT_FALSE(bench.tick());
  EXPECT_EQ(bench.state(), CaptureState::idle);
}

TEST(Capture, NowBeginsWithTheFirstTickAndEndsWithTheLastSample) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 5, 3)));
  EXPECT_EQ(bench.state(), CaptureState::waiting);
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(bench.capture.readable());
    EXPECT_TRUE(bench.tick());
    EXPECT_EQ(bench.capture.readings().taken, static_cast<std::uint32_t>(i + 1));
  }
  EXPECT_FALSE(bench.capture.ISR_wants(0));
  const CaptureReadings readings = bench.capture.readings();
  EXPECT_EQ(readings.trigger_sample, 0u) << "there is no time before 'now'";
  EXPECT_EQ(readings.first_tick, 100u);
  EXPECT_EQ(readings.channels, 2u);
  bench.expect_words({count, flags}, 1);
}

// 0: as many as fit, also where a sample does not fit wholly, and beyond what the window can show.
TEST(Capture, SamplesThatAreNotGivenFillTheStorage) {
  for (const std::uint32_t samples : {0u, 6u, 7u, 0xFFFFFFFFu}) {
    Bench bench(13);
    ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, samples)));
    bench.ticks(20);
    EXPECT_EQ(bench.capture.readings().taken, 6u);
    bench.expect_words({count, flags}, 1);
    EXPECT_EQ(bench.storage[12], 0xDEADBEEFu);
  }
  Bench large(capture_words + 100);
  ASSERT_TRUE(large.capture.arm(config_of(CaptureTrigger::now, 0)));
  large.ticks(capture_words);
  EXPECT_EQ(large.capture.readings().taken, capture_words / 2);
  EXPECT_EQ(large.word(capture_words - 1), Bench::word_of(100 + capture_words / 2 - 1, flags));
  EXPECT_EQ(large.storage[capture_words], 0xDEADBEEFu);
}

TEST(Capture, WithoutChannelsOrWithoutRoomItIsRefusedAndNothingChanges) {
  Bench bench(3);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 1)));
  bench.tick();
  EXPECT_FALSE(bench.capture.arm(CaptureConfig{}));
  CaptureConfig four;
  four.channels = {count, flags, count, flags};
  EXPECT_FALSE(bench.capture.arm(four));
  EXPECT_FALSE(bench.capture.ISR_wants(0));
  bench.expect_words({count, flags}, 1);
  Bench nothing(0);
  EXPECT_FALSE(nothing.capture.arm(config_of(CaptureTrigger::now, 1)));
}

TEST(Capture, OneChannelMayStandTwiceAndFourFit) {
  Bench bench(64);
  CaptureConfig config = config_of(CaptureTrigger::now, 3);
  config.channels = {position, flags, position, electrical_angle};
  ASSERT_TRUE(bench.capture.arm(config));
  bench.ticks(3);
  bench.expect_words({position, flags, position, electrical_angle}, 1);
}

TEST(Capture, ContactIsTheStepIntoTheWallNotBeingThere) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 4, 2)));
  bench.ticks(5, inside);
  EXPECT_EQ(bench.state(), CaptureState::waiting);
  bench.ticks(3);
  EXPECT_EQ(bench.state(), CaptureState::waiting);
  bench.tick(inside);
  EXPECT_EQ(bench.state(), CaptureState::running);
  bench.ticks(3);
  EXPECT_EQ(bench.capture.readings().trigger_sample, 2u);
  EXPECT_EQ(bench.capture.readings().first_tick, 106u);
  bench.expect_words({count, flags}, 1);
}

TEST(Capture, AFaultTriggersWhenItComesAndTheRestIsStillTaken) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::fault, 8, 4)));
  bench.ticks(3, faulty);  // there before
  bench.ticks(7);
  bench.ticks(10, faulty);
  EXPECT_EQ(bench.capture.readings().trigger_sample, 4u);
  EXPECT_EQ(bench.capture.readings().first_tick, 106u);
  bench.expect_words({count, flags}, 1);
}

TEST(Capture, AFaultBeforeThePreTriggerIsFullCountsAndAllSamplesAreTaken) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::fault, 8, 6)));
  bench.ticks(2);
  bench.ticks(6, faulty);
  const CaptureReadings readings = bench.capture.readings();
  EXPECT_EQ(readings.state, CaptureState::complete);
  EXPECT_EQ(readings.trigger_sample, 2u);
  EXPECT_EQ(readings.taken, 8u);
  EXPECT_EQ(readings.first_tick, 100u);
  bench.expect_words({count, flags}, 1);
}

TEST(Capture, LevelsAreMagnitudesAndWhatIsNotANumberPassesNone) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const bool of_force : {true, false}) {
    Bench bench(64);
    CaptureConfig config = config_of(of_force ? CaptureTrigger::force : CaptureTrigger::velocity, 1);
    config.level = 0.5f;
    const auto event = [of_force](float value) {
      return of_force ? CaptureEvent{0, value, 9.0f} : CaptureEvent{0, 9.0f, value};
    };
    for (const float passing : {0.50001f, -0.50001f, 1e30f, -std::numeric_limits<float>::infinity()}) {
      ASSERT_TRUE(bench.capture.arm(config));
      for (const float below : {0.0f, 0.5f, -0.5f, nan}) bench.tick(event(below));
      EXPECT_EQ(bench.state(), CaptureState::waiting);
      bench.tick(event(passing));
      EXPECT_EQ(bench.state(), CaptureState::complete) << passing;
    }
  }
}

// The flag lasts for one tick only, which need not be one that is recorded.
TEST(Capture, AnExcitationThatStartsBetweenTwoSamplesOrInTheFirstTickTriggers) {
  constexpr CaptureEvent start{capture_flag::excitation_started, 0.0f, 0.0f};
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::excitation, 2)));
  bench.tick(start);
  EXPECT_EQ(bench.state(), CaptureState::running);
  EXPECT_EQ(bench.capture.readings().first_tick, 100u);

  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::excitation, 4, 2, 10)));
  bench.ticks(33);  // samples at 101, 111, 121, 131
  EXPECT_FALSE(bench.tick(start));
  EXPECT_EQ(bench.state(), CaptureState::running);
  bench.ticks(50);
  EXPECT_EQ(bench.capture.readings().trigger_sample, 2u);
  EXPECT_EQ(bench.capture.readings().first_tick, 121u);
  bench.expect_words({count, flags}, 10);
}

TEST(Capture, WithoutSamplesBeforeItTheTriggerIsOnTheGridAndWaitingWritesNothing) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 3, 0, 7)));
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(bench.tick());
  EXPECT_TRUE(bench.tick(inside));
  bench.ticks(14);
  EXPECT_EQ(bench.capture.readings().first_tick, 110u);
  bench.expect_words({count, flags}, 7);
}

TEST(Capture, MoreSamplesBeforeTheTriggerThanThereAreLeaveRoomForTheTriggersOwn) {
  for (const std::uint32_t pre : {4u, 5u, 0xFFFFFFFFu}) {
    Bench bench(64);
    ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 5, pre)));
    bench.ticks(50);
    bench.tick(inside);
    EXPECT_EQ(bench.state(), CaptureState::complete);
    EXPECT_EQ(bench.capture.readings().trigger_sample, 4u);
    bench.expect_words({count, flags}, 1);
  }
}

TEST(Capture, AnIntervalOfZeroIsOneAndTheLongestOneDoesNotWrap) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 3, 0, 0)));
  bench.ticks(3);
  bench.expect_words({count, flags}, 1);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 2, 0, 0xFFFFFFFFu)));
  EXPECT_TRUE(bench.tick());
  for (int i = 0; i < 100'000; ++i) ASSERT_FALSE(bench.tick());
  EXPECT_EQ(bench.state(), CaptureState::running);
}

TEST(Capture, TheTickCounterMayWrapOnTheWay) {
  Bench bench(64);
  bench.now = 0xFFFFFFF0u;
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 8, 4, 3)));
  bench.ticks(17);
  bench.tick(inside);  // tick 1; samples at ... -7, -4, -1, 2
  bench.ticks(20);
  EXPECT_EQ(bench.capture.readings().first_tick, 0xFFFFFFF6u);
  bench.expect_words({count, flags}, 3);
}

TEST(Capture, OnlyTheAxisAskedForIsRecorded) {
  Bench bench(64);
  CaptureConfig config = config_of(CaptureTrigger::now, 4);
  config.axis = 1;
  ASSERT_TRUE(bench.capture.arm(config));
  EXPECT_FALSE(bench.tick({}, 0));
  EXPECT_TRUE(bench.tick({}, 1));
  // Over to the other axis while running: the first one's ticks are not taken any more.
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 2)));
  EXPECT_FALSE(bench.tick({}, 1));
  EXPECT_TRUE(bench.tick({}, 0));
  EXPECT_FALSE(bench.tick({}, 1));
  EXPECT_EQ(bench.capture.readings().taken, 1u);
}

TEST(Capture, ArmedAnewItForgetsAtOnceWhatItHad) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 4)));
  bench.ticks(4);
  ASSERT_TRUE(bench.capture.readable());
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 6, 2)));
  // Before the tick has seen it.
  EXPECT_EQ(bench.state(), CaptureState::waiting);
  EXPECT_EQ(bench.capture.readings().taken, 0u);
  EXPECT_FALSE(bench.capture.readable());
  EXPECT_EQ(bench.word(0), 0u);
  bench.ticks(3);
  bench.tick(inside);
  bench.tick();
  EXPECT_EQ(bench.state(), CaptureState::running);
  EXPECT_EQ(bench.word(0), 0u) << "nothing is given away before it is complete";
  EXPECT_FALSE(bench.capture.readable());
  // Anew while running, with other channels.
  CaptureConfig other = config_of(CaptureTrigger::now, 2);
  other.channels = {electrical_angle};
  ASSERT_TRUE(bench.capture.arm(other));
  bench.ticks(2);
  bench.expect_words({electrical_angle}, 1);
}

TEST(Capture, StoppedWhileWaitingItIsIdleWhileRunningItHasWhatItHas) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 10, 4)));
  bench.ticks(20);
  bench.capture.stop();
  EXPECT_FALSE(bench.tick(inside));
  EXPECT_EQ(bench.state(), CaptureState::idle);
  EXPECT_EQ(bench.word(0), 0u);

  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::contact, 10, 4)));
  bench.ticks(27);
  bench.tick(inside);
  bench.ticks(2);
  bench.capture.stop();
  EXPECT_FALSE(bench.capture.readable()) << "the tick may still write";
  EXPECT_FALSE(bench.tick());
  EXPECT_EQ(bench.capture.readings().taken, 7u);
  EXPECT_EQ(bench.capture.readings().trigger_sample, 4u);
  bench.expect_words({count, flags}, 1);
  // Complete stays complete.
  bench.capture.stop();
  bench.expect_words({count, flags}, 1);
  EXPECT_FALSE(bench.capture.ISR_wants(0));
}

TEST(Capture, StoppedBeforeTheTickSawItThereIsNothingToReadNotEvenTheOld) {
  Bench bench(64);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 4)));
  bench.ticks(4);
  ASSERT_TRUE(bench.capture.arm(config_of(CaptureTrigger::now, 4)));
  bench.capture.stop();
  EXPECT_FALSE(bench.capture.readable());
  EXPECT_NE(bench.state(), CaptureState::complete);
  bench.tick();
  EXPECT_EQ(bench.state(), CaptureState::idle);
  EXPECT_EQ(bench.word(0), 0u);
  bench.tick();
  EXPECT_FALSE(bench.capture.ISR_wants(0));
}

// Whatever is asked for and whenever the trigger comes: the samples are those of the ticks that the readings
// name, on the grid, as many as were asked for, and the trigger's is the first at or after it.
RC_GTEST_PROP(CaptureProperty, TheSamplesAreThoseOfTheTicksTheyAreSaidToBe, ()) {
  const auto words = *rc::gen::inRange<std::size_t>(2, 60);
  Bench bench(words);
  bench.now = *rc::gen::arbitrary<std::uint32_t>();
  // Several in a row: nothing is left over from the one before.
  for (int run = 0; run < 3; ++run) {
    const auto interval = *rc::gen::inRange<std::uint32_t>(1, 6);
    const auto samples = *rc::gen::inRange<std::uint32_t>(0, 40);
    const auto pre = *rc::gen::inRange<std::uint32_t>(0, 40);
    const auto wait = *rc::gen::inRange<std::uint32_t>(0, 150);
    const auto fit = static_cast<std::uint32_t>(words / 2);
    const std::uint32_t taken = samples == 0 ? fit : std::min(samples, fit);
    RC_ASSERT(bench.capture.arm(config_of(CaptureTrigger::fault, samples, pre, interval)));
    const std::uint32_t began = bench.now;
    bench.tick();
    bench.ticks(wait);
    const std::uint32_t triggered = bench.now;
    bench.ticks(taken * interval + interval, faulty);
    const CaptureReadings readings = bench.capture.readings();
    RC_ASSERT(readings.state == CaptureState::complete);
    RC_ASSERT(readings.taken == taken);
    const std::uint32_t grid = readings.first_tick - (std::min(pre, taken - 1) == 0 ? triggered : began);
    RC_ASSERT(grid % interval == 0);
    const std::uint32_t late = readings.first_tick + readings.trigger_sample * interval - triggered;
    RC_ASSERT(late < interval);
    const std::uint32_t before = (wait + interval) / interval;  // samples there were
    RC_ASSERT(readings.trigger_sample == std::min({pre, taken - 1, before}));
    for (std::uint32_t s = 0; s < taken; ++s) {
      const std::uint32_t tick = readings.first_tick + s * interval;
      RC_ASSERT(bench.word(2 * s) == Bench::word_of(tick, count));
      RC_ASSERT(bench.word(2 * s + 1) == Bench::word_of(tick, flags));
    }
    RC_ASSERT(bench.word(2 * taken) == 0u);
  }
}

}  // namespace
}  // namespace kmax::firmware::capture_test
