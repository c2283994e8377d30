#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host_tools/calibration/shaking.hpp"

namespace kmax::calibration_test::induced_voltage_test {

using bench::Waveforms;
using calibration::induced_in_waves;
using calibration::InducedVoltage;
using calibration::MotorKnowledge;

constexpr std::size_t half_period = 20, waves = 6;
constexpr double amperes = 0.6, noise = 0.2;  // A, V

MotorKnowledge gimbal() {
  MotorKnowledge known;
  known.kind = firmware::MotorKind::pmsm;
  known.resistance = 10.4;
  return known;
}

/// A square wave of current through a winding; `turning`: V that a rotor induces at its fastest, swinging
/// once to and fro in two half waves; `angle`: rad electrical of the rotor away from the frame that stands.
Waveforms shaken(double turning, double angle, double interval = 0.001) {
  std::mt19937 random(7);
  std::normal_distribution<double> noisy(0.0, noise);
  Waveforms seen;
  seen.interval = interval;
  for (std::size_t k = 0; k < half_period * waves; ++k) {
    const std::size_t in_wave = k % half_period;
    const double current = k / half_period % 2 == 0 ? amperes : -amperes;
    const double sign = current < 0.0 ? -1.0 : 1.0;
    const double speed = sign * (2.0 * static_cast<double>(in_wave) / half_period - 1.0);
    // The first sample after an edge still has the voltage that turns the current around.
    const double edge = in_wave == 0 ? 8.0 * sign : 0.0;
    seen.channels["current"].push_back(current);
    seen.channels["voltage"].push_back(gimbal().resistance * current + edge +
                                       turning * speed * std::cos(angle) + noisy(random));
    seen.channels["voltage_d"].push_back(turning * speed * std::sin(angle) + noisy(random));
  }
  return seen;
}

InducedVoltage induced(const Waveforms& seen) {
  return induced_in_waves(seen, gimbal(), half_period, 0, half_period * waves);
}

TEST(InducedVoltage, OfAStandingMotorIsNotSure) {
  EXPECT_FALSE(induced(shaken(0.0, 0.0)).sure(gimbal(), amperes));
}

TEST(InducedVoltage, IsSureWhereverTheRotorStandsToTheFrame) {
  for (const double angle : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    const InducedVoltage found = induced(shaken(1.5, angle));
    EXPECT_TRUE(found.sure(gimbal(), amperes)) << angle;
    // From -1.5 V to 1.5 V in half a wave.
    EXPECT_NEAR(found.volts, 3.0, 0.4) << angle;
  }
}

TEST(InducedVoltage, AcrossTheFrameIsMissedByOneComponentAlone) {
  Waveforms seen = shaken(1.5, 1.57);
  seen.channels.erase("voltage_d");
  EXPECT_FALSE(induced(seen).sure(gimbal(), amperes));
}

TEST(InducedVoltage, IsNotTakenFromWavesInWhichTheCurrentStillSettles) {
  EXPECT_TRUE(std::isinf(induced(shaken(1.5, 0.0, 0.0001)).error));
}

}  // namespace kmax::calibration_test::induced_voltage_test
