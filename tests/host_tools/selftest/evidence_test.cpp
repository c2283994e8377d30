#include "host_tools/selftest/checks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::selftest::evidence_test {

using firmware::Fault;
using firmware::Refusal;

Evidence armed_at_24_volts() {
  Evidence evidence;
  evidence.supply = {23.9, 24.0, 24.1};
  evidence.temperature = 30.0;
  evidence.arming.armed = true;
  return evidence;
}

TEST(Evidence, WhatStandsEarlierExplainsWhatStandsLater) {
  Report report;
  report.checks = {{"supply", Verdict::fail, "", {}, "supply"},
                   {"phases", Verdict::fail, "", {}, "phase A (open)"}};
  EXPECT_EQ(report.first_failure()->part, "supply");
  EXPECT_NE(conclusion(report).find("supply; mend it first"), std::string::npos);
  EXPECT_NE(conclusion(report).find("(phases)"), std::string::npos);
  report.checks[0].verdict = Verdict::not_judged;
  EXPECT_EQ(conclusion(report), "The faulty part is: phase A (open).");
  report.checks[1].verdict = Verdict::pass;
  EXPECT_EQ(conclusion(report), "No fault was found; not judged: supply.");
}

TEST(Evidence, TheSupplysLimitsBelongToTheAllowed) {
  Evidence evidence = armed_at_24_volts();
  for (const auto& [volts, verdict] : std::vector<std::pair<double, Verdict>>{
           {7.9, Verdict::fail}, {8.0, Verdict::pass}, {26.0, Verdict::pass}, {26.1, Verdict::fail}}) {
    evidence.supply = {volts};
    EXPECT_EQ(check_supply(evidence).verdict, verdict) << volts;
  }
  evidence.supply = {24.0};
  evidence.pulse_fault = Fault::under_voltage;
  EXPECT_EQ(check_supply(evidence).part, "supply");
}

/// 24 V that feed 2 A for 2 ms, and what is left of them there: `supply` of the share of the time.
template <typename Supply>
Evidence loaded(Supply supply) {
  Evidence evidence = armed_at_24_volts();
  evidence.phases = PhaseFinding{.circuit = Circuit::healthy, .admittance = 1.0, .judged_resistance = 1.0};
  PulseResponse& swing = evidence.under_load.emplace();
  swing.before = 20;
  swing.pulse.duration = 40;
  for (unsigned k = 0; k < 70; ++k) {
    const double share = k < 20 ? 0.0 : std::min(1.0, (k - 20) / 40.0);
    const double current = k < 20 ? 0.0 : 2.0;
    swing.voltage.push_back(6.0 * current);
    swing.current_b.push_back(current);
    swing.current_c.push_back(-current);
    swing.position.push_back(0.0);
    swing.supply.push_back(supply(share));
  }
  return evidence;
}

TEST(Evidence, ASupplyIsJudgedAtTheCurrentLimitOnlyByAResistanceThatWasFound) {
  // 0.3 ohm, and a capacitor for half a millisecond.
  const CheckResult strong =
      check_supply(loaded([](double share) { return 24.0 - 0.3 * (1.0 - std::exp(-4.0 * share)); }));
  EXPECT_EQ(strong.verdict, Verdict::pass) << strong.message;
  EXPECT_NE(strong.message.find("with the motor held at current.limit"), std::string::npos);
  // One that gives nothing any more, but what its capacitor has, falls faster and faster: of no resistance.
  const CheckResult dead =
      check_supply(loaded([](double share) { return 24.0 - 1.5 * std::pow(share, 1.3); }));
  EXPECT_EQ(dead.verdict, Verdict::not_judged) << dead.message;
  EXPECT_NE(dead.message.find("falls to 22.50 V"), std::string::npos) << dead.message;
  EXPECT_EQ(dead.message.find("source resistance about"), std::string::npos) << dead.message;
  for (const MeasuredValue& value : dead.values) EXPECT_NE(value.name, "source_resistance");
  // More than a tenth is too much, whatever its resistance is.
  EXPECT_EQ(check_supply(loaded([](double share) { return 24.0 - 3.0 * std::pow(share, 1.3); })).verdict,
            Verdict::fail);
}

TEST(Evidence, AGateDriverThatDoesNotAnswerIsNotBlamedForAMissingSupply) {
  Evidence evidence = armed_at_24_volts();
  evidence.arming = {false, Refusal::power_stage_not_ready, Fault::none};
  EXPECT_EQ(check_gate_driver(evidence).part, "gate driver");
  evidence.supply = {0.3};
  EXPECT_EQ(check_gate_driver(evidence).verdict, Verdict::not_judged);
  EXPECT_EQ(check_supply(evidence).part, "supply");
}

TEST(Evidence, AnAmplifierThatReadsAgainstItsRailIsTheCurrentSense) {
  Evidence evidence = armed_at_24_volts();
  evidence.arming = {false, Refusal::current_sense_invalid, Fault::none};
  EXPECT_EQ(check_current_sense(evidence).part, "current sense");
}

TEST(Evidence, AnImplausibleTemperatureIsTheSensors) {
  Evidence evidence = armed_at_24_volts();
  for (const double celsius : {std::numeric_limits<double>::quiet_NaN(), -20.0, 200.0}) {
    evidence.temperature = celsius;
    EXPECT_EQ(check_temperature(evidence).part, "temperature sensor");
  }
  evidence.temperature = 101.0;
  EXPECT_EQ(check_temperature(evidence).part, "power stage (too hot)");
}

TEST(Evidence, AHandleThatSomethingElseMovedIsAFailure) {
  Evidence evidence = armed_at_24_volts();
  evidence.largest_displacement = 1.0e-3;
  EXPECT_EQ(check_handle(evidence).verdict, Verdict::pass);
  evidence.largest_displacement = 1.01e-3;
  EXPECT_EQ(check_handle(evidence).part, "handle");
  evidence.largest_displacement = 0.1e-3;
  evidence.arming.fault = Fault::excitation_travel;
  EXPECT_EQ(check_handle(evidence).part, "handle");
  evidence.arming.fault = Fault::none;
  evidence.pulse_fault = Fault::excitation_travel;
  EXPECT_EQ(check_handle(evidence).verdict, Verdict::pass);
  evidence.largest_displacement = 0.8e-3;
  EXPECT_EQ(check_handle(evidence).part, "handle");
  evidence.pulse_fault = Fault::none;
  evidence.pulse_withheld = true;
  EXPECT_EQ(check_handle(evidence).part, "handle");
  EXPECT_EQ(check_phases(evidence).message, "something else moved the handle");
  // Not by an encoder that is not there.
  evidence.arming = {false, Refusal::encoder_invalid, Fault::none};
  EXPECT_EQ(check_handle(evidence).verdict, Verdict::not_judged);
}

TEST(Evidence, WithoutAPowerStageNothingOfItIsJudged) {
  Evidence evidence = armed_at_24_volts();
  evidence.supply = {0.0, 0.0};
  for (const CheckResult& check : run_checks(evidence)) EXPECT_NE(check.verdict, Verdict::fail) << check.name;
}

}  // namespace kmax::selftest::evidence_test
