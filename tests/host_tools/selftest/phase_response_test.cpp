#include "host_tools/selftest/evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host_tools/bench/winding_model.hpp"

namespace kmax::selftest::phase_response_test {

/// Pulses whose sensors answer b and c times the winding's current.
std::vector<PulseResponse> answers(const AxisFacts& facts,
                                   const std::vector<std::pair<double, double>>& factors) {
  std::vector<PulseResponse> all;
  for (const auto& [b, c] : factors) {
    const double direction = static_cast<double>(all.size()) * 2.0 * std::numbers::pi / 3.0;
    PulseResponse response;
    response.before = 20;
    response.pulse = {1.0, 20, 40, 0, direction};
    response.voltage.assign(20, 0.0);
    for (int k = 0; k < 40; ++k) response.voltage.push_back(k < 20 ? 1.0 : -1.0);
    response.voltage.insert(response.voltage.end(), 20, 0.0);
    const auto driven =
        bench::lagged_voltage(response.voltage, facts.inductance / facts.resistance, facts.tick);
    for (std::size_t k = 0; k < driven.size(); ++k) {
      const double noise = 0.01 * std::sin(12.9898 * static_cast<double>(k * k));
      response.current_b.push_back(0.05 + b * driven[k] / facts.resistance + noise);
      response.current_c.push_back(-0.03 + c * driven[k] / facts.resistance - noise);
    }
    all.push_back(response);
  }
  return all;
}

AxisFacts motor(bool synchronous, bool calibrated = true) {
  AxisFacts facts;
  facts.synchronous = synchronous;
  facts.calibrated = calibrated;
  return facts;
}

Circuit judged(const AxisFacts& facts, const std::vector<std::pair<double, double>>& factors) {
  return judge_phases(answers(facts, factors), facts).circuit;
}

// Currents of B and C per volt along A, B, C over R, by Kirchhoff's laws for a star with conductances a, b,
// c.
std::vector<std::pair<double, double>> star(double a, double b, double c) {
  std::vector<std::pair<double, double>> factors;
  for (int direction = 0; direction < 3; ++direction) {
    const double va = direction == 0 ? 1.0 : -0.5, vb = direction == 1 ? 1.0 : -0.5,
                 vc = direction == 2 ? 1.0 : -0.5;
    const double centre = (a * va + b * vb + c * vc) / (a + b + c);
    factors.push_back({b * (vb - centre), c * (vc - centre)});
  }
  return factors;
}

TEST(JudgePhases, AStarByKirchhoffsLaws) {
  const AxisFacts facts = motor(true);
  EXPECT_EQ(judged(facts, star(1, 1, 1)), Circuit::healthy);
  EXPECT_EQ(judged(facts, star(1.2, 0.9, 1)), Circuit::healthy);
  EXPECT_EQ(judged(facts, star(0, 1, 1)), Circuit::open_a);
  EXPECT_EQ(judged(facts, star(1, 0, 1)), Circuit::open_b);
  EXPECT_EQ(judged(facts, star(1, 1, 0)), Circuit::open_c);
  EXPECT_NEAR(judge_phases(answers(facts, star(0.5, 0.5, 0.5)), facts).admittance, 0.5, 0.02);
}

TEST(JudgePhases, SensorsChangeTheirOwnNumbersAlone) {
  const AxisFacts facts = motor(true);
  const auto changed = [](double of_b, double of_c) {
    auto factors = star(1, 1, 1);
    for (auto& [b, c] : factors) {
      b *= of_b;
      c *= of_c;
    }
    return factors;
  };
  EXPECT_EQ(judged(facts, changed(-1, 1)), Circuit::sense_b_inverted);
  EXPECT_EQ(judged(facts, changed(1, -1)), Circuit::sense_c_inverted);
  EXPECT_EQ(judged(facts, changed(-1, -1)), Circuit::both_inverted);
  EXPECT_EQ(judged(facts, changed(0, 1)), Circuit::sense_b_dead);
  EXPECT_EQ(judged(facts, changed(1, 0)), Circuit::sense_c_dead);
  EXPECT_EQ(judged(facts, changed(0, 0)), Circuit::nothing_flows);
}

TEST(JudgePhases, AShortBetweenTwoPhasesOutweighsTheWinding) {
  const AxisFacts facts = motor(true);
  EXPECT_EQ(judged(facts, star(30, 30, 1)), Circuit::short_ab);
  EXPECT_EQ(judged(facts, star(1, 30, 30)), Circuit::short_bc);
  EXPECT_EQ(judged(facts, star(30, 1, 30)), Circuit::short_ca);
  EXPECT_EQ(judged(facts, star(10, 10, 10)), Circuit::short_circuit);
  // Nothing is known of the resistance before a calibration.
  EXPECT_EQ(judged(motor(true, false), star(10, 10, 10)), Circuit::healthy);
}

TEST(JudgePhases, ADcMotorIsOneCircuit) {
  const AxisFacts facts = motor(false);
  EXPECT_EQ(judged(facts, {{1, -1}}), Circuit::healthy);
  EXPECT_EQ(judged(facts, {{0, 0}}), Circuit::nothing_flows);
  EXPECT_EQ(judged(facts, {{-1, -1}}), Circuit::sense_b_inverted);
  EXPECT_EQ(judged(facts, {{1, 1}}), Circuit::sense_c_inverted);
  EXPECT_EQ(judged(facts, {{0, -1}}), Circuit::sense_b_dead);
  EXPECT_EQ(judged(facts, {{1, 0}}), Circuit::sense_c_dead);
  EXPECT_EQ(judged(facts, {{8, -8}}), Circuit::short_circuit);
}

TEST(JudgePhases, WhatFitsNothingIsUnclear) {
  EXPECT_EQ(judged(motor(false), {{1.0, -0.45}}), Circuit::unclear);
}

}  // namespace kmax::selftest::phase_response_test
