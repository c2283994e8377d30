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
  std::vector<RigSample> samples;
  for (int i = 0; i < 400; ++i) {
    const double time = 0.01 * i;
    double position = 0.005;  // an offset that must not count
    if (time >= 1.0 && time < 1.5) position += 0.010;
    if (time >= 3.0 && time < 3.5) position -= 0.004;
    samples.push_back({time, 0.0, 0.0, position, 0.0});
  }
  const DeviationMeasure measure = measure_deviation(samples, std::vector<double>{0.985, 2.985}, 0.5);
  EXPECT_NEAR(measure.without, 0.010, 1e-12);
  EXPECT_NEAR(measure.with, 0.004, 1e-12);
  EXPECT_EQ(measure.pulses, 2u);
}

TEST(MeasureDeviation, PulsesThatWereNotRecordedAreNotCounted) {
  const std::vector<RigSample> samples{{}, {0.1, 0.0, 0.0, 0.002, 0.0}};
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

std::vector<DeviationResult> simulated(const simulation::OperatorModel& person) {
  SimulatedRig rig("deviation", {person}, deviation_hands());
  return run_deviation(rig, {quick()}).results;
}

RigTouch touch_of(const DeviationProtocol& protocol, double background, double interference) {
  SimulatedRig rig("deviation", {simulation::OperatorModel{}}, deviation_hands());
  rig.set({protocol.stiffness, protocol.haptic_rate, control::InterferenceMode::parallel});
  return rig.record(deviation_plan(protocol, {background, interference, 0.0}));
}

TEST(SimulatedDeviation, FallsWithTheBackgroundForceAndContactIsKept) {
  const std::vector<DeviationResult> results = simulated({});
  EXPECT_EQ(judge_deviation(results).claim_met(), true);
  for (const DeviationResult& result : results) {
    EXPECT_GT(result.contact_share, 0.99);
    if (result.paper.background > 0.0) {
      EXPECT_LT(result.deviation, result.before);
    }
  }
}

// The point of the experiment: it is the stiffening that makes the trend.
TEST(SimulatedDeviation, AHandThatDoesNotStiffenShowsNoTrend) {
  simulation::OperatorModel person;
  person.activation_gain = 0.0;
  const DeviationVerdict verdict = judge_deviation(simulated(person));
  EXPECT_EQ(verdict.claim_met(), false);
  for (const BackgroundTrend& trend : verdict.trends)
    EXPECT_NEAR(trend.with.value() / trend.without.value(), 1.0, 0.01);
}

// A hand at rest gives way by F/k; k1 and k2 in series, less the friction.
TEST(SimulatedDeviation, ALongPulseMovesTheHandAsFarAsItsSpringsSay) {
  DeviationProtocol protocol = quick();
  protocol.pulse_on = protocol.pulse_off = 3.0;
  const RigTouch touch = touch_of(protocol, 0.0, 3.0);
  const double stiffness = simulation::series_stiffness(simulation::OperatorModel{});
  const std::vector<double> begins{protocol.pulse_begin(0) - 0.001, protocol.pulse_begin(2) - 0.001};
  EXPECT_NEAR(measure_deviation(touch.samples, begins, protocol.pulse_on).without, 3.0 / stiffness,
              deviation_hands().device.friction / stiffness + 1e-4);
}

TEST(SimulatedDeviation, TheForceAlongTheSurfaceComesInPulses) {
  for (const RigSample& sample : touch_of(quick(), 3.0, 5.0).samples) {
    bool on = false;
    for (int pulse = 0; pulse < 4; ++pulse) {
      const double since = sample.time - quick().pulse_begin(pulse);
      on = on || (since >= -1e-9 && since < 0.5 - 1e-9);
    }
    ASSERT_EQ(sample.tangential_force, on ? 5.0 : 0.0) << sample.time;
  }
}

TEST(SimulatedDeviation, SettingsOutOfRangeAreRefused) {
  SimulatedRig rig("deviation", {simulation::OperatorModel{}}, deviation_hands());
  DeviationSettings settings;
  settings.protocol.pulse_on = std::nan("");
  EXPECT_THROW(run_deviation(rig, settings), std::invalid_argument);
}

}  // namespace
}  // namespace kmax::experiment::deviation_experiment_test
