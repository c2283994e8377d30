// What the dead time of the simulated inverter does to a sine current through zero under the current
// controllers, and what their compensation makes of it.
#include <gtest/gtest.h>

#include "tests/host_tools/simulation/sine_through_zero.hpp"

namespace kmax::simulation::dead_time_under_control_test {

using test::DeadTimeShare;
using test::SineThroughZero;

constexpr BrushedDcMotorConfig brushed[] = {{1.0, 0.5e-3, 0.03}, {8.0, 0.3e-3, 0.03}, {0.3, 0.1e-3, 0.03}};
constexpr SynchronousMotorConfig synchronous[] = {
    {0.6, 0.3e-3, 0.3e-3, 0.05, 7}, {0.08, 0.03e-3, 0.04e-3, 0.008, 7}, {5.0, 2.5e-3, 2.5e-3, 0.1, 7}};

template <typename Motor>
void expect_cleaner(const Motor& motor) {
  for (const double dead_time : {119e-9, 500e-9}) {
    for (const double amplitude : {0.1, 1.0}) {
      SineThroughZero run{.amplitude = amplitude, .dead_time = dead_time};
      const double without = test::distortion_of(run, motor).harmonics;
      run.share = DeadTimeShare::of_reference;
      const auto with = test::distortion_of(run, motor);
      // A sine of a hundredth of a percent is clean; a slow loop on a tough winding has little to gain.
      EXPECT_LT(with.harmonics, without > 0.02 ? 0.75 * without : without + 1e-3)
          << motor.resistance << " ohm, " << dead_time << " s, " << amplitude << " A: " << without;
      if (without > 0.05) {
        EXPECT_LT(with.harmonics, 0.4 * without)
            << motor.resistance << " ohm, " << dead_time << " s, " << amplitude << " A";
      }
    }
  }
}

TEST(DeadTimeUnderControl, TheSineThroughZeroIsCleaner) {
  for (const auto& motor : brushed) expect_cleaner(motor);
  for (const auto& motor : synchronous) expect_cleaner(motor);
}

// Too much by the dead time itself: from the reference that is what too little is, no more. The current never
// exceeds what the surplus voltage can drive through the winding besides the reference.
template <typename Motor>
void expect_bounded(const Motor& motor, double share_voltages) {
  for (const double dead_time : {119e-9, 500e-9}) {
    for (const double amplitude : {0.1, 1.0}) {
      SineThroughZero run{
          .amplitude = amplitude, .dead_time = dead_time, .share = DeadTimeShare::of_reference};
      run.assumed_dead_time = 2.0 * dead_time;
      const auto doubled = test::distortion_of(run, motor);
      const double surplus = share_voltages * dead_time * 20000.0 * run.supply;
      EXPECT_LT(doubled.largest, 1.1 * amplitude + surplus / motor.resistance) << motor.resistance;
      EXPECT_NEAR(doubled.fundamental / amplitude, 1.0, 2.0 * surplus / motor.resistance / amplitude + 0.1)
          << motor.resistance;
    }
  }
}

TEST(DeadTimeUnderControl, TwiceTheDeadTimeDestabilisesNothing) {
  for (const auto& motor : brushed) expect_bounded(motor, 2.0);
  for (const auto& motor : synchronous) expect_bounded(motor, 4.0 / 3.0);
}

// Without anything asked for there is nothing to compensate: no current, no hunting, not even told twice too
// much, with a converter whose steps are as wide as the band.
TEST(DeadTimeUnderControl, AtRestNothingMoves) {
  for (const double step : {0.0, 0.02}) {
    SineThroughZero run{.amplitude = 0.0, .dead_time = 500e-9, .share = DeadTimeShare::of_reference};
    run.assumed_dead_time = 1e-6;
    run.converter_step = step;
    for (const auto& motor : brushed) {
      for (const double current : test::currents_of(run, motor)) ASSERT_NEAR(current, 0.0, 1e-6);
    }
  }
}

// Why the reference and not the measured current.
TEST(DeadTimeUnderControl, TheMeasuredCurrentFeedsBackOnItself) {
  SineThroughZero run{.amplitude = 0.1, .dead_time = 500e-9, .share = DeadTimeShare::of_measured};
  run.assumed_dead_time = 1e-6;
  EXPECT_GT(test::distortion_of(run, synchronous[1]).largest, 1.0) << "ten times what is asked for";
  run.share = DeadTimeShare::of_reference;
  EXPECT_LT(test::distortion_of(run, synchronous[1]).largest, 0.12);
}

}  // namespace kmax::simulation::dead_time_under_control_test
