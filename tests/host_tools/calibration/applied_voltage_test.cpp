#include "host_tools/calibration/applied_voltage.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "board/odrive_v3/description.hpp"
#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"

namespace kmax::calibration::applied_voltage_test {

constexpr const board::BoardDescription& board = board::odrive_v3::description;

double ticks(float duty) {
  return std::floor(static_cast<double>(duty) * 4200.0 + 0.5);
}

// The controllers' own duties, rounded as the timer does.
TEST(AppliedVoltage, IsWhatTheControllersDutiesGive) {
  control::DcCurrentControllerConfig<float> brushed;
  const auto dc = control::DcCurrentController<float>::prepare(brushed, 50e-6f);
  control::FieldOrientedControllerConfig<float> synchronous;
  const auto three = control::FieldOrientedController<float>::prepare(synchronous, 50e-6f);
  int differing = 0;
  for (int n = -40; n <= 40; ++n) {
    const float volts = 0.1337f * static_cast<float>(n);
    const auto out = control::DcCurrentController<float>::voltage(dc, volts, 24.0f);
    EXPECT_NEAR(applied_brushed_voltage(board, static_cast<double>(volts), 24.0),
                (ticks(out.duty_b) - ticks(out.duty_c)) / 4200.0 * 24.0, 1e-9);

    control::FieldOrientedController<float>::Input in;
    in.angle = static_cast<control::TurnFraction>(n + 40) * 53000000u;
    in.supply = 24.0f;
    const double angle = static_cast<double>(in.angle) / 4294967296.0 * 6.283185307179586;
    const auto duties = control::FieldOrientedController<float>::voltage(three, in, volts, 0.5f);
    const double a = ticks(duties.duty_a), b = ticks(duties.duty_b), c = ticks(duties.duty_c);
    const double alpha = 24.0 / 4200.0 * (2.0 * a - b - c) / 3.0,
                 beta = 24.0 / 4200.0 * (b - c) / std::sqrt(3.0);
    const VoltageVector given = applied_vector(board, {static_cast<double>(volts), 0.5}, angle, 24.0);
    const double off = std::hypot(given.d - (alpha * std::cos(angle) + beta * std::sin(angle)),
                                  given.q - (beta * std::cos(angle) - alpha * std::sin(angle)));
    EXPECT_LT(off, 8e-3);
    differing += off > 1e-4 ? 1 : 0;
  }
  // Where a duty lies close to half a tick, float and double may round it to different sides.
  EXPECT_LE(differing, 4);
}

TEST(AppliedVoltage, StaysWithinATimersTickOfWhatWasAsked) {
  for (int n = -100; n <= 100; ++n) {
    const double volts = 0.0371 * n;
    EXPECT_NEAR(applied_brushed_voltage(board, volts, 24.0), volts, 24.0 / 4200.0 + 1e-9);
    const VoltageVector given = applied_vector(board, {volts, -0.2}, 0.1 * n, 24.0);
    EXPECT_NEAR(given.d, volts, 24.0 / 4200.0 + 1e-9);
    EXPECT_NEAR(given.q, -0.2, 24.0 / 4200.0 + 1e-9);
  }
}

TEST(AppliedVoltage, ACoarserTimerOfAnotherBoardGivesWholeStepsOfItsOwn) {
  board::BoardDescription coarse = board;
  coarse.half_period_ticks = 100;
  EXPECT_NEAR(applied_brushed_voltage(coarse, 1.0, 24.0), 0.96, 1e-9) << "two legs, 2 of 100 steps each";
  EXPECT_NEAR(applied_vector(coarse, {1.0, 0.0}, 0.0, 24.0).d, 0.96, 1e-9);
}

TEST(AppliedVoltage, IsBoundedByTheSupplyAndZeroWithoutOne) {
  EXPECT_NEAR(applied_brushed_voltage(board, 100.0, 24.0), 24.0, 1e-9);
  EXPECT_EQ(applied_brushed_voltage(board, 1.0, 0.0), 0.0);
  EXPECT_EQ(applied_vector(board, {1.0, 1.0}, 0.3, 0.0).d, 0.0);
}

}  // namespace kmax::calibration::applied_voltage_test
