#include "host_tools/calibration/phase_response.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace kmax::calibration::phase_response_test {

/// B and C of a motor of 1 ohm at 1 V along 0 and along 90 degrees, phase resistances a, b, c; infinite:
/// open.
std::array<SensorAnswer, 2> responses(double a, double b, double c) {
  std::array<SensorAnswer, 2> both;
  for (int i = 0; i < 2; ++i) {
    const double alpha = i == 0 ? 1.0 : 0.0, beta = i == 0 ? 0.0 : 1.0;
    const std::array<double, 3> volts = {alpha, -0.5 * alpha + std::sqrt(0.75) * beta,
                                         -0.5 * alpha - std::sqrt(0.75) * beta};
    const std::array<double, 3> ohms = {a, b, c};
    double conductance = 0.0, weighted = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      conductance += 1.0 / ohms[k];
      weighted += volts[k] / ohms[k];
    }
    const double star = weighted / conductance;
    both[static_cast<std::size_t>(i)] = {(volts[1] - star) / ohms[1], (volts[2] - star) / ohms[2]};
  }
  return both;
}

std::string cause(const SensorAnswer& first, const SensorAnswer& second, bool brushed = false) {
  const auto diagnosis = diagnose_phases(brushed, first, second);
  return diagnosis ? diagnosis->cause : "";
}

constexpr double open = 1e9;

TEST(DiagnosePhases, TellsEveryOpenPhase) {
  const auto check = [](double a, double b, double c) {
    const auto seen = responses(a, b, c);
    return cause(seen[0], seen[1]);
  };
  EXPECT_EQ(check(1, 1, 1), "");
  EXPECT_EQ(check(open, 1, 1), "phase_a_open");
  EXPECT_EQ(check(1, open, 1), "phase_b_open");
  EXPECT_EQ(check(1, 1, open), "phase_c_open");
}

TEST(DiagnosePhases, TellsEveryInvertedOrDeadSensor) {
  const auto seen = responses(1, 1, 1);
  const auto check = [&](double b, double c) {
    return cause({b * seen[0].b, c * seen[0].c}, {b * seen[1].b, c * seen[1].c});
  };
  EXPECT_EQ(check(-1, 1), "current_b_inverted");
  EXPECT_EQ(check(1, -1), "current_c_inverted");
  EXPECT_EQ(check(-1, -1), "current_b_and_c_inverted");
  EXPECT_EQ(check(0, 1), "current_b_dead");
  EXPECT_EQ(check(1, 0), "current_c_dead");
}

TEST(DiagnosePhases, TakesNoOffenceAtPhasesThatDifferByAThird) {
  for (const double a : {0.75, 1.0, 1.33}) {
    for (const double b : {0.75, 1.0, 1.33}) {
      const auto seen = responses(a, b, 1.0);
      EXPECT_EQ(cause(seen[0], seen[1]), "") << a << " " << b;
    }
  }
}

TEST(DiagnosePhases, NamesNoSingleDefectForWhatIsNone) {
  EXPECT_EQ(cause({0.5, 0.5}, {0.5, 0.5}), "phases_unbalanced");
  EXPECT_EQ(cause({}, {}), "phases_unbalanced");
}

TEST(DiagnosePhases, KnowsABrushedMotorsTwoSensors) {
  EXPECT_EQ(cause({1, -1}, {}, true), "");
  EXPECT_EQ(cause({-1, -1}, {}, true), "current_b_inverted");
  EXPECT_EQ(cause({1, 1}, {}, true), "current_c_inverted");
  EXPECT_EQ(cause({-1, 1}, {}, true), "current_b_and_c_inverted");
  EXPECT_EQ(cause({0, -1}, {}, true), "current_b_dead");
  EXPECT_EQ(cause({1, 0}, {}, true), "current_c_dead");
}

// The sign of the current at the end of a half wave is the voltage's, for a quick and for a slow winding.
TEST(PhaseAnswer, HasTheVoltagesSignWhateverTheTimeConstant) {
  for (const double ticks : {0.2, 5.0, 40.0, 1000.0}) {
    const double keep = std::exp(-1.0 / ticks);
    std::vector<double> voltage, b, c;
    double current = 0.0;
    for (int k = 0; k < 400; ++k) {
      voltage.push_back(k / 20 % 2 == 0 ? 1.0 : -1.0);
      b.push_back(current);
      c.push_back(-current + 3.0);  // an offset is not a response
      current = keep * current + (1.0 - keep) * voltage.back();
    }
    const SensorAnswer seen = phase_response(voltage, b, c, 20, 100);
    EXPECT_GT(seen.b, 0.0) << ticks;
    EXPECT_NEAR(seen.c, -seen.b, 1e-9) << ticks;
  }
}

TEST(PhaseAnswer, IsNothingWithoutAWave) {
  const std::vector<double> steady(100, 1.0);
  const SensorAnswer seen = phase_response(steady, steady, steady, 20, 0);
  EXPECT_EQ(seen.b, 0.0);
  EXPECT_EQ(seen.c, 0.0);
  EXPECT_EQ(phase_response({}, {}, {}, 20, 0).b, 0.0);
}

}  // namespace kmax::calibration::phase_response_test
