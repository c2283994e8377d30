#include "host_tools/experiment/deviation/deviation_experiment.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::experiment::deviation_experiment_test {
namespace {

DeviationProtocol quick() {
  DeviationProtocol protocol;
  protocol.pulses = 2;
  return protocol;
}

TEST(DeviationProtocol, PulsesFollowARestInEachHalf) {
  const DeviationProtocol protocol;  // 1.5 s, five pulses of a second each
  EXPECT_DOUBLE_EQ(protocol.onset(), 6.5);
  EXPECT_DOUBLE_EQ(protocol.duration(), 13.0);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(0), 1.5);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(4), 5.5);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(5), 8.0);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(9), 12.0);
}

TEST(MeasureDeviation, TakesEachPulseFromWhereItBegan) {
  std::vector<DeviationSample> samples;
  for (int i = 0; i < 400; ++i) {
    const double time = 0.01 * i;
    double position = 0.005;  // an offset that must not count
    if (time >= 1.0 && time < 1.5) position += 0.010;
    if (time >= 3.0 && time < 3.5) position -= 0.004;
    samples.push_back({time, position, 0.0});
  }
  const DeviationMeasure measure = measure_deviation(samples, std::vector<double>{0.985, 2.985}, 0.5);
  EXPECT_NEAR(measure.without, 0.010, 1e-12);
  EXPECT_NEAR(measure.with, 0.004, 1e-12);
  EXPECT_EQ(measure.pulses, 2u);
}

TEST(MeasureDeviation, PulsesThatWereNotRecordedAreNotCounted) {
  const std::vector<DeviationSample> samples{{0.0, 0.0, 0.0}, {0.1, 0.002, 0.0}};
  const DeviationMeasure measure = measure_deviation(samples, std::vector<double>{0.0, 5.0}, 0.5);
  EXPECT_EQ(measure.pulses, 1u);
  EXPECT_DOUBLE_EQ(measure.without, 0.002);
  EXPECT_EQ(measure.with, 0.0);
  EXPECT_EQ(measure_deviation({}, std::vector<double>{0.0}, 0.5).pulses, 0u);
}

std::vector<DeviationResult> as_printed() {
  std::vector<DeviationResult> results;
  for (const paper::DeviationCell& cell : paper::table_2) {
    DeviationTouch touch;
    touch.touched = true;
    touch.measure.with = cell.deviation;
    touch.measure.pulses = 10;
    results.push_back(mean_deviation(cell, {&touch, 1}));
  }
  return results;
}

TEST(JudgeDeviation, ThePapersOwnTableMeetsItsClaim) {
  const DeviationVerdict verdict = judge_deviation(as_printed());
  EXPECT_EQ(verdict.claim_met(), true);
  EXPECT_DOUBLE_EQ(verdict.rank.value(), 1.0);
  ASSERT_EQ(verdict.trends.size(), 3u);
  for (const BackgroundTrend& trend : verdict.trends) EXPECT_DOUBLE_EQ(trend.rank.value(), -1.0);
}

TEST(JudgeDeviation, ANumberThatStaysDoesNotFall) {
  std::vector<DeviationResult> results = as_printed();
  for (DeviationResult& result : results) result.deviation = 5e-3;
  EXPECT_EQ(judge_deviation(results).claim_met(), false);
}

TEST(JudgeDeviation, WhatNobodyTouchedIsNotShownAndLeavesThePapersNumbersAlone) {
  std::vector<DeviationResult> results = as_printed();
  for (DeviationResult& result : results) result.touches = 0;
  for (const DeviationVerdict& verdict : {judge_deviation(results), judge_deviation({})}) {
    EXPECT_EQ(verdict.claim_met(), std::nullopt);
    ASSERT_EQ(verdict.trends.size(), 3u);
    for (const BackgroundTrend& trend : verdict.trends) {
      EXPECT_EQ(trend.without, std::nullopt);
      EXPECT_EQ(trend.with, std::nullopt);
    }
  }
  const std::vector<BackgroundTrend> printed = printed_deviation_trends();
  ASSERT_EQ(printed.size(), 3u);
  EXPECT_EQ(printed[0].interference, 3.0);
  EXPECT_EQ(printed[0].without, 1.40e-3);
  EXPECT_EQ(printed[0].with, 0.68e-3);
  EXPECT_EQ(printed[2].without, 16.6e-3);
  EXPECT_EQ(printed[2].with, 7.8e-3);
  EXPECT_EQ(all_fall(printed), true);
}

TEST(SimulateDeviation, FallsWithTheBackgroundForceAndContactIsKept) {
  DeviationSettings settings;
  settings.protocol = quick();
  const std::vector<DeviationResult> results = run_deviation(settings, {simulation::OperatorModel{}});
  EXPECT_EQ(judge_deviation(results).claim_met(), true);
  for (const DeviationResult& result : results) {
    EXPECT_GT(result.contact_share, 0.99);
    if (result.paper.background > 0.0) {
      EXPECT_LT(result.deviation, result.before);
    }
  }
}

// The point of the experiment: it is the stiffening that makes the trend.
TEST(SimulateDeviation, AHandThatDoesNotStiffenShowsNoTrend) {
  DeviationSettings settings;
  settings.protocol = quick();
  simulation::OperatorModel person;
  person.activation_gain = 0.0;
  const DeviationVerdict verdict = judge_deviation(run_deviation(settings, {person}));
  EXPECT_EQ(verdict.claim_met(), false);
  for (const BackgroundTrend& trend : verdict.trends)
    EXPECT_NEAR(trend.with.value() / trend.without.value(), 1.0, 0.01);
}

// A hand at rest gives way by F/k; k1 and k2 in series, less the friction.
TEST(SimulateDeviation, ALongPulseMovesTheHandAsFarAsItsSpringsSay) {
  DeviationSettings settings;
  settings.protocol = quick();
  settings.protocol.pulse_on = 3.0;
  settings.protocol.pulse_off = 3.0;
  const simulation::OperatorModel person;
  const DeviationTouch touch = simulate_deviation(settings, person, 0.0, 3.0);
  const double expected = 3.0 / simulation::series_stiffness(person);
  EXPECT_NEAR(touch.measure.without, expected,
              settings.device.friction / simulation::series_stiffness(person) + 1e-4);
}

TEST(SimulateDeviation, TheForceAlongTheSurfaceComesInPulses) {
  DeviationSettings settings;
  settings.protocol = quick();
  std::vector<DeviationSample> samples;
  simulate_deviation(settings, {}, 3.0, 5.0, &samples);
  for (const DeviationSample& sample : samples) {
    bool on = false;
    for (int pulse = 0; pulse < 4; ++pulse) {
      const double begin = settings.protocol.pulse_begin(pulse);
      on = on || (sample.time >= begin && sample.time < begin + 0.5);
    }
    ASSERT_EQ(sample.force, on ? 5.0 : 0.0) << sample.time;
  }
}

TEST(SimulateDeviation, SettingsOutOfRangeAreRefused) {
  DeviationSettings settings;
  settings.push = 3.0;
  EXPECT_THROW(simulate_deviation(settings, {}, 3.0, 5.0), std::invalid_argument);
  settings = {};
  settings.protocol.pulse_on = std::nan("");
  EXPECT_THROW(simulate_deviation(settings, {}, 0.0, 1.0), std::invalid_argument);
  EXPECT_THROW(run_deviation({}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace kmax::experiment::deviation_experiment_test
