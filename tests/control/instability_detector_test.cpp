#include "control/instability_detector.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

namespace kmax::control::instability_detector_test {

using Detector = InstabilityDetector<float>;
using Config = InstabilityDetectorConfig<float>;

constexpr double pi = 3.14159265358979;
constexpr double force_threshold = 0.3, displacement_threshold = 8e-5;

Detector::Coefficients at_rate(double rate) {
  Config config;
  config.rate = static_cast<float>(rate);
  return Detector::prepare(config);
}

struct Sample {
  float displacement, force;
};

/// Seconds until it is first called unstable, -1: never.
double found_after(Detector& detector, const Detector::Coefficients& c, double rate,
                   const std::vector<Sample>& signal) {
  for (std::size_t n = 0; n < signal.size(); ++n)
    if (detector.update(c, signal[n].displacement, signal[n].force)) return static_cast<double>(n) / rate;
  return -1.0;
}

/// Amplitudes as multiples of the thresholds. The force pushes out what has gone in.
std::vector<Sample> sine(double rate, double frequency, double phase, double displacement, double force,
                         double seconds, double decay = 0.0) {
  std::vector<Sample> signal;
  for (int n = 0; n < static_cast<int>(seconds * rate); ++n) {
    const double time = n / rate;
    const double wave = std::exp(-decay * time) * std::sin(2.0 * pi * frequency * time + phase);
    signal.push_back({static_cast<float>(displacement * displacement_threshold * wave - 2e-4),
                      static_cast<float>(1.0 - force * force_threshold * wave)});
  }
  return signal;
}

double between(double least, double most) {
  return least + (most - least) * *rc::gen::inRange(0, 100001) / 100000.0;
}

double any_rate() {
  return *rc::gen::element(500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0);
}

/// Pieces of steps, ramps, sines and noise, each signal within +-1.
std::vector<Sample> any_signal(std::size_t length) {
  std::vector<Sample> signal;
  auto random = static_cast<std::uint32_t>(*rc::gen::inRange(1, 1 << 30));
  const auto unit = [&random] {
    random = random * 1664525U + 1013904223U;
    return static_cast<double>(random >> 8) / 8388608.0 - 1.0;
  };
  while (signal.size() < length) {
    const int kind = *rc::gen::inRange(0, 4);
    const double step = between(0.005, 1.5), a = between(-1.0, 1.0), b = between(-1.0, 1.0);
    const int samples = *rc::gen::inRange(1, 400);
    for (int n = 0; n < samples; ++n) {
      double x = a, f = b;
      if (kind == 1) x = std::sin(step * n), f = -std::sin(step * n + b);
      if (kind == 2) x = unit(), f = unit();
      if (kind == 3) x = n % 2 == 0 ? 1.0 : -1.0, f = -x;
      signal.push_back({static_cast<float>(x), static_cast<float>(f)});
    }
  }
  return signal;
}

RC_GTEST_PROP(InstabilityDetector, NeverCallsASmallSignalUnstable, ()) {
  const auto c = at_rate(any_rate());
  const bool small_force = *rc::gen::arbitrary<bool>();
  const double displacement = displacement_threshold * (small_force ? between(1.0, 50.0) : 0.999);
  const double force = force_threshold * (small_force ? 0.999 : between(1.0, 50.0));
  Detector detector;
  for (const Sample& sample : any_signal(20000)) {
    RC_ASSERT(!detector.update(c, static_cast<float>(displacement) * sample.displacement,
                               static_cast<float>(force) * sample.force));
  }
}

RC_GTEST_PROP(InstabilityDetector, FindsEverySineOfItsBandWithin300Milliseconds, ()) {
  const double rate = any_rate();
  const double frequency = 15.0 * std::pow(std::min(rate / 10.0, 400.0) / 15.0, between(0.0, 1.0));
  const double displacement = 1.06 * std::pow(20.0, between(0.0, 1.0)),
               force = 1.06 * std::pow(10.0, between(0.0, 1.0));
  Detector detector;
  const double found = found_after(detector, at_rate(rate), rate,
                                   sine(rate, frequency, between(0.0, 2.0 * pi), displacement, force, 0.6));
  RC_ASSERT(found >= 0.0);
  RC_ASSERT(found <= 0.3);
}

RC_GTEST_PROP(InstabilityDetector, TheMirroredSignalGivesTheSame, ()) {
  const auto c = at_rate(any_rate());
  Detector one, mirrored;
  const auto displacement = static_cast<float>(displacement_threshold * between(0.5, 20.0));
  const auto force = static_cast<float>(force_threshold * between(0.5, 10.0));
  for (const Sample& sample : any_signal(20000)) {
    const float x = displacement * sample.displacement, f = force * sample.force;
    RC_ASSERT(one.update(c, x, f) == mirrored.update(c, -x, -f));
    RC_ASSERT(one.displacement_amplitude() == mirrored.displacement_amplitude());
    RC_ASSERT(one.force_amplitude() == mirrored.force_amplitude());
  }
}

RC_GTEST_PROP(InstabilityDetector, ScalesWithItsThresholdsToTheBit, ()) {
  const auto larger = std::ldexp(1.0F, *rc::gen::inRange(-8, 9)),
             stronger = std::ldexp(1.0F, *rc::gen::inRange(-8, 9));
  Config config, scaled;
  config.rate = scaled.rate = static_cast<float>(any_rate());
  scaled.displacement_threshold *= larger;
  scaled.force_threshold *= stronger;
  const auto c = Detector::prepare(config), d = Detector::prepare(scaled);
  Detector one, other;
  for (const Sample& sample : any_signal(20000)) {
    const float x = 5e-4F * sample.displacement, f = 2.0F * sample.force;
    RC_ASSERT(one.update(c, x, f) == other.update(d, larger * x, stronger * f));
    RC_ASSERT(larger * one.displacement_amplitude() == other.displacement_amplitude());
    RC_ASSERT(stronger * one.force_amplitude() == other.force_amplitude());
  }
}

// As fast as a hand trembles or taps, at any size.
RC_GTEST_PROP(InstabilityDetector, NothingSlowerThanItsBandIsUnstable, ()) {
  const double rate = any_rate(), frequency = between(0.2, 14.0);
  const auto c = at_rate(rate);
  Detector detector;
  const double size = between(1.0, 200.0), depth = between(-1.0, 1.0);
  for (int n = 0; n < static_cast<int>(3.0 * rate); ++n) {
    const double x = displacement_threshold * size * (std::sin(2.0 * pi * frequency * n / rate) + depth);
    // A wall: no force outside.
    const double f = x < 0.0 ? -5000.0 * x : 0.0;
    RC_ASSERT(!detector.update(c, static_cast<float>(x), static_cast<float>(f)));
  }
}

// What a hit leaves behind: a quarter of its energy lost in each settling time.
RC_GTEST_PROP(InstabilityDetector, WhatDiesDownIsStable, ()) {
  const double rate = any_rate(), frequency = between(30.0, 50.0);
  Detector detector;
  RC_ASSERT(found_after(detector, at_rate(rate), rate,
                        sine(rate, frequency, between(0.0, 2.0 * pi), between(2.0, 30.0), between(2.0, 10.0),
                             2.0, between(4.0, 40.0))) < 0.0);
}

RC_GTEST_PROP(InstabilityDetector, AnyBitsLeaveItSound, ()) {
  Config config;
  config.rate = 500.0F;
  const auto c = Detector::prepare(config);
  Detector detector;
  auto random = static_cast<std::uint32_t>(*rc::gen::inRange(1, 1 << 30));
  const auto any = [&random] {
    random = random * 1664525U + 1013904223U;
    constexpr float special[] = {std::numeric_limits<float>::quiet_NaN(),
                                 std::numeric_limits<float>::infinity(),
                                 -std::numeric_limits<float>::infinity(),
                                 std::numeric_limits<float>::max(),
                                 -std::numeric_limits<float>::max(),
                                 std::numeric_limits<float>::denorm_min(),
                                 0.0F,
                                 -0.0F};
    return (random >> 28) < 4 ? special[(random >> 20) % 8] : std::bit_cast<float>(random);
  };
  for (int n = 0; n < 5000; ++n) {
    const float x = any(), f = any();
    detector.update(c, x, f);
    RC_ASSERT(is_finite(detector.displacement_amplitude()) && detector.displacement_amplitude() >= 0.0F);
    RC_ASSERT(is_finite(detector.force_amplitude()) && detector.force_amplitude() >= 0.0F);
  }
  // It still finds what it should.
  RC_ASSERT(found_after(detector, c, 500.0, sine(500.0, 40.0, 0.0, 5.0, 5.0, 0.6)) <= 0.4);
  RC_ASSERT(detector.unstable());
}

TEST(InstabilityDetector, GivesTheAmplitudes) {
  const double rate = 20000.0;
  Detector detector;
  const auto c = at_rate(rate);
  for (const Sample& sample : sine(rate, 60.0, 0.3, 5.0, 4.0, 1.0))
    detector.update(c, sample.displacement, sample.force);
  EXPECT_NEAR(static_cast<double>(detector.displacement_amplitude()), 5.0 * displacement_threshold, 1e-6);
  EXPECT_NEAR(static_cast<double>(detector.force_amplitude()), 4.0 * force_threshold, 1e-3);
  EXPECT_TRUE(detector.unstable());
}

// Slow motion under an oscillation is not taken for it.
TEST(InstabilityDetector, SlowMotionIsLeftOutOfTheAmplitude) {
  const double rate = 1000.0;
  Detector detector;
  const auto c = at_rate(rate);
  for (int n = 0; n < 2000; ++n) {
    const double time = n / rate;
    const double x = 2e-4 * std::sin(2.0 * pi * 40.0 * time) - 0.01 * time;
    detector.update(c, static_cast<float>(x), static_cast<float>(-5000.0 * x));
  }
  EXPECT_NEAR(static_cast<double>(detector.displacement_amplitude()), 2e-4, 2e-5);
}

TEST(InstabilityDetector, EndsWithTheOscillation) {
  const double rate = 2000.0;
  const auto c = at_rate(rate);
  for (const double rest : {0.0, 1.0}) {  // free space, or held still in the wall
    Detector detector;
    ASSERT_GE(found_after(detector, c, rate, sine(rate, 40.0, 0.0, 5.0, 5.0, 0.6)), 0.0);
    int last = -1;
    for (int n = 0; n < 2000; ++n)
      if (detector.update(c, 0.0F, static_cast<float>(rest))) last = n;
    EXPECT_LE(last, static_cast<int>(rate / 15.0) + 1);
    EXPECT_EQ(detector.displacement_amplitude(), 0.0F);
    EXPECT_EQ(detector.force_amplitude(), 0.0F);
  }
}

TEST(InstabilityDetector, ABouncingHandleStaysWatched) {
  // In the wall for 10 ms of every 40.
  const double rate = 5000.0;
  const auto c = at_rate(rate);
  Detector detector;
  bool found = false;
  for (int n = 0; n < 2500; ++n) {
    const double x = 1e-3 * (std::sin(2.0 * pi * 25.0 * n / rate) + 0.7);
    found =
        detector.update(c, static_cast<float>(x), x < 0.0 ? static_cast<float>(-5000.0 * x) : 0.0F) || found;
  }
  EXPECT_TRUE(found);
}

TEST(InstabilityDetector, FreeSpaceNeverWakesIt) {
  const auto c = at_rate(500.0);
  Detector detector;
  for (int n = 0; n < 5000; ++n)
    ASSERT_FALSE(detector.update(c, n % 8 < 4 ? 1e-3F : -1e-3F, n % 8 < 4 ? 0.07F : -0.07F));
}

// No filter drifts and no counter wraps: after 1e8 samples of a held contact all is as in the beginning.
TEST(InstabilityDetector, NothingDriftsIn100MillionSamples) {
  const double rate = 20000.0;
  const auto c = at_rate(rate);
  Detector held, fresh;
  for (int n = 0; n < 100'000'000; ++n) held.update(c, (n & 1024) != 0 ? -2e-4F : -2.5e-4F, 1.0F);
  const auto signal = sine(rate, 80.0, 0.0, 3.0, 3.0, 1.0);
  const double found = found_after(held, c, rate, signal);
  EXPECT_GE(found, 0.0);
  EXPECT_NEAR(found, found_after(fresh, c, rate, signal), 2.0 / 80.0);
}

TEST(InstabilityDetector, ResetForgets) {
  const double rate = 500.0;
  const auto c = at_rate(rate);
  Detector detector;
  const auto signal = sine(rate, 40.0, 0.0, 5.0, 5.0, 0.6);
  const double first = found_after(detector, c, rate, signal);
  ASSERT_GE(first, 0.0);
  detector.reset();
  EXPECT_FALSE(detector.unstable());
  EXPECT_EQ(found_after(detector, c, rate, signal), first);
}

TEST(InstabilityDetector, KeepsTheLastAlarmAtItsStrongestAndCountsThem) {
  const double rate = 5000.0;
  const auto c = at_rate(rate);
  Detector detector;
  EXPECT_EQ(detector.alarms(), 0U);
  EXPECT_EQ(detector.last_alarm().force, 0.0F);
  // Grows to ten times the thresholds and dies down; then one that is weaker and slower.
  auto signal = sine(rate, 50.0, 0.0, 2.5, 2.5, 0.5, -2.0 * std::log(2.0));
  const auto fading = sine(rate, 50.0, 0.0, 5.0, 5.0, 0.5, 10.0);
  signal.insert(signal.end(), fading.begin(), fading.end());
  found_after(detector, c, rate, signal);
  for (const Sample& sample : signal) detector.update(c, sample.displacement, sample.force);
  EXPECT_FALSE(detector.unstable());
  ASSERT_GE(detector.alarms(), 1U);
  const auto strongest = detector.last_alarm();
  EXPECT_NEAR(static_cast<double>(strongest.force), 5.0 * force_threshold, 0.1 * 5.0 * force_threshold);
  EXPECT_NEAR(static_cast<double>(strongest.displacement), 5.0 * displacement_threshold,
              0.1 * 5.0 * displacement_threshold);
  EXPECT_NEAR(static_cast<double>(strongest.frequency), 50.0, 2.5);
  const auto before = detector.alarms();
  detector.reset();
  EXPECT_EQ(detector.alarms(), before) << "they have been";
  ASSERT_GE(found_after(detector, c, rate, sine(rate, 30.0, 0.0, 1.5, 1.5, 1.0)), 0.0);
  EXPECT_EQ(detector.alarms(), before + 1);
  EXPECT_NEAR(static_cast<double>(detector.last_alarm().force), 1.5 * force_threshold,
              0.1 * 1.5 * force_threshold);
  EXPECT_NEAR(static_cast<double>(detector.last_alarm().frequency), 30.0, 1.5);
}

TEST(InstabilityDetector, ForgetsItsAlarmsWhenItIsTold) {
  const double rate = 5000.0;
  const auto c = at_rate(rate);
  Detector detector;
  ASSERT_GE(found_after(detector, c, rate, sine(rate, 30.0, 0.0, 1.5, 1.5, 1.0)), 0.0);
  ASSERT_EQ(detector.alarms(), 1U);
  detector.forget_alarms();
  EXPECT_EQ(detector.alarms(), 0U);
  EXPECT_EQ(detector.last_alarm().force, 0.0F);
  EXPECT_EQ(detector.last_alarm().frequency, 0.0F);
  EXPECT_TRUE(detector.unstable()) << "what is, is";
}

TEST(InstabilityDetector, TakesAnyConfiguration) {
  for (const float odd : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(), 1e-30F}) {
    Config config;
    config.lowest_frequency = config.settling_time = config.rate = odd;
    const auto c = Detector::prepare(config);
    EXPECT_GE(c.longest, 1U);
    EXPECT_LE(c.longest, 1'000'000'001U);
    EXPECT_GE(c.settling, 1U);
    Detector detector;
    for (int n = 0; n < 1000; ++n) detector.update(c, n % 8 < 4 ? 1e-3F : -1e-3F, n % 8 < 4 ? 1.0F : -1.0F);
    EXPECT_TRUE(is_finite(detector.force_amplitude()));
  }
}

}  // namespace kmax::control::instability_detector_test
