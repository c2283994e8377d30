#include "host_tools/simulation/force_delay.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <set>
#include <utility>
#include <vector>

namespace kmax::simulation::force_delay_test {

struct Piece {
  double duration;
  double force;
};

std::vector<Piece> pass_interval(ForceDelay& delay, double force, double duration) {
  std::vector<Piece> pieces;
  delay.command(force, duration);
  for (double left = duration; left > 0.0;) {
    const double piece = delay.piece(left);
    pieces.push_back({piece, delay.force()});
    delay.pass(piece);
    left = piece == left ? 0.0 : left - piece;
  }
  return pieces;
}

TEST(ForceDelay, WithoutDelayACommandActsAtOnce) {
  ForceDelay delay;
  for (int n = 1; n < 100; ++n) {
    const std::vector<Piece> pieces = pass_interval(delay, n, 0.002);
    ASSERT_EQ(pieces.size(), 1u);
    EXPECT_EQ(pieces[0].force, n);
    EXPECT_EQ(pieces[0].duration, 0.002);
  }
}

TEST(ForceDelay, BeforeTheFirstCommandArrivesTheForceIsZero) {
  ForceDelay delay(0.005);
  for (int n = 0; n < 2; ++n) {
    const std::vector<Piece> pieces = pass_interval(delay, 7.0, 0.002);
    ASSERT_EQ(pieces.size(), 1u);
    EXPECT_EQ(pieces[0].force, 0.0);
  }
  const std::vector<Piece> third = pass_interval(delay, 7.0, 0.002);
  ASSERT_EQ(third.size(), 2u);
  EXPECT_NEAR(third[0].duration, 0.001, 1e-15);
  EXPECT_EQ(third[0].force, 0.0);
  EXPECT_EQ(third[1].force, 7.0);
}

TEST(ForceDelay, WholeNumbersOfIntervalsMakeNoSlivers) {
  for (const double interval : {0.002, 0.001, 0.0007, 1e-4, 50e-6, 1.0 / 3000.0}) {
    for (const int samples : {1, 2, 3, 7, 100}) {
      ForceDelay delay(samples * interval);
      for (int n = 0; n < 500; ++n) {
        const std::vector<Piece> pieces = pass_interval(delay, n + 1, interval);
        ASSERT_EQ(pieces.size(), 1u) << interval << " " << samples << " " << n;
        EXPECT_EQ(pieces[0].force, n < samples ? 0.0 : n + 1 - samples);
      }
    }
  }
}

// The matrices of the exact method are kept by duration.
TEST(ForceDelay, EqualIntervalsGiveEqualPiecesToTheLastBit) {
  for (const double late : {0.00033, 0.0007, 0.00174, 0.0033, 0.0199, 0.51}) {
    ForceDelay delay(late);
    std::set<double> durations;
    for (int n = 0; n < 5000; ++n) {
      for (const Piece& piece : pass_interval(delay, n, 0.002)) {
        if (n > 300) durations.insert(piece.duration);
      }
    }
    EXPECT_LE(durations.size(), 2u) << late;
  }
}

TEST(ForceDelay, LongDelaysDoNotDrift) {
  ForceDelay delay(1.0);
  double time = 0.0;
  for (int n = 0; n < 100'000; ++n) {
    double now = n * 0.0003;
    for (const Piece& piece : pass_interval(delay, n + 1, 0.0003)) {
      if (piece.force > 0.0) {
        // Commands n + 1 take effect at 0.0003 n + 1.
        const double since = now - (0.0003 * (piece.force - 1.0) + 1.0);
        ASSERT_GE(since, -1e-9);
        ASSERT_LE(since, 0.0003 + 1e-9);
      }
      now += piece.duration;
      time += piece.duration;
    }
  }
  EXPECT_NEAR(time, 30.0, 1e-8);
}

RC_GTEST_PROP(ForceDelay, IsTheCommandedStaircaseShifted, ()) {
  const double late = *rc::gen::inRange(0, 2000) * 1e-5;
  ForceDelay delay(late);
  std::vector<std::pair<double, double>> commanded;  // time, force
  double time = 0.0;
  for (int n = 0; n < 60; ++n) {
    const double duration = *rc::gen::inRange(1, 500) * 1e-5;
    const double force = n + 1;
    commanded.push_back({time, force});
    double now = time;
    for (const Piece& piece : pass_interval(delay, force, duration)) {
      RC_ASSERT(piece.duration > 0.0);
      const double middle = now + 0.5 * piece.duration;
      double expected = 0.0;
      for (const auto& [when, value] : commanded) {
        if (when + late <= middle) expected = value;
      }
      if (piece.duration > 1e-9) RC_ASSERT(piece.force == expected);
      now += piece.duration;
    }
    RC_ASSERT(std::abs(now - (time + duration)) < 1e-12);
    time += duration;
  }
}

}  // namespace kmax::simulation::force_delay_test
