#include "control/foaw_velocity.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace kmax::control::foaw_velocity_test {

struct Choice {
  int window = 1;
  double slope = 0.0;  // steps per sample
};

double slope_of(const std::vector<double>& newest_first, int n, FoawFit fit) {
  if (fit == FoawFit::end) return (newest_first[0] - newest_first[static_cast<std::size_t>(n)]) / n;
  double numerator = 0.0;
  for (int l = 0; l <= n; ++l)
    numerator += (n - 2 * l) * (newest_first[static_cast<std::size_t>(l)] - newest_first[0]);
  return numerator / (n * (n + 1) * (n + 2) / 6.0);
}

// The definition, written down literally: for every window its own chord, checked against every sample of the
// window; over the last one that held, the slope of the fit. `newest_first` in steps. The tolerance lies far
// below the smallest distance of two different slopes of chords, 1/240.
Choice defined_choice(const std::vector<double>& newest_first, int longest, FoawFit fit) {
  int window = 1;
  for (int n = 1; n <= longest; ++n) {
    const double chord = slope_of(newest_first, n, FoawFit::end);
    bool holds = true;
    for (int j = 1; j <= n; ++j) {
      const double line = newest_first[0] - chord * j;
      holds = holds && std::fabs(line - newest_first[static_cast<std::size_t>(j)]) <= 1.0 + 1e-7;
    }
    if (!holds) break;
    window = n;
  }
  return {window, slope_of(newest_first, window, fit)};
}

// Motions that make windows of all lengths: bounded accelerations, noise of a step, jumps, still stretches.
std::vector<std::int64_t> motion(unsigned seed, int length) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<std::int64_t> positions;
  double position = 0.0;
  double speed = 0.0;
  double acceleration = 0.0;
  double noise = 0.0;
  for (int k = 0; k < length; ++k) {
    if (k % 40 == 0) {
      acceleration = unit(random) * std::pow(10.0, -4.0 + 4.0 * std::fabs(unit(random)));
      noise = random() % 3 == 0 ? std::fabs(unit(random)) * 1.5 : 0.0;
      if (random() % 3 == 0) speed = unit(random) * std::pow(10.0, 4.0 * std::fabs(unit(random)));
      if (random() % 4 == 0) speed = acceleration = 0.0;
      if (random() % 8 == 0) position += 1e4 * unit(random);
    }
    speed += acceleration;
    position += speed;
    positions.push_back(static_cast<std::int64_t>(std::floor(position + noise * unit(random))));
  }
  return positions;
}

template <typename Scalar>
void agrees_with_the_definition(unsigned seed, std::int32_t window, std::int32_t step, std::int64_t origin,
                                FoawFit fit, double tolerance, std::vector<int>& histogram) {
  const auto period = static_cast<Scalar>(5e-5);
  const auto length = static_cast<Scalar>(1e-7);
  const auto coefficients = FoawVelocity<Scalar>::prepare(window, period, length, step);
  const double scale = static_cast<double>(length) * step / static_cast<double>(period);
  FoawVelocity<Scalar> velocity;
  velocity.reset(origin * step);
  std::vector<double> newest_first(17, 0.0);
  for (const std::int64_t position : motion(seed, 400)) {
    newest_first.insert(newest_first.begin(), static_cast<double>(position));
    newest_first.pop_back();
    const auto estimate = static_cast<double>(velocity.update(coefficients, (origin + position) * step, fit));
    const Choice expected = defined_choice(newest_first, window, fit);
    RC_ASSERT(velocity.window() == expected.window);
    RC_ASSERT(std::fabs(estimate - expected.slope * scale) <=
              tolerance * scale * (1.0 + std::fabs(expected.slope)));
    ++histogram[static_cast<std::size_t>(expected.window)];
  }
}

TEST(FoawVelocity, BothFitsAreTheDefinitionForEveryWindow) {
  for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
    std::vector<int> histogram(17);
    const bool agrees = rc::check([&](unsigned seed, bool far) {
      const auto window = *rc::gen::inRange(1, 17);
      const auto step = *rc::gen::element(1, 2, 550, 1 << 16);
      agrees_with_the_definition<double>(seed, window, step, far ? 100'000'000 : 0, fit, 1e-12, histogram);
      agrees_with_the_definition<float>(seed, 16, step, far ? -100'000'000 : 0, fit, 1e-6, histogram);
    });
    EXPECT_TRUE(agrees);
    for (std::size_t n = 1; n <= 16; ++n) EXPECT_GT(histogram[n], 0) << "no window of " << n << " was tried";
  }
}

// Every sequence of six intervals of -2 .. 2 steps after a standstill: the ties of the band, all of them.
TEST(FoawVelocity, SmallStepsAreTheDefinitionExhaustively) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 1.0, 1.0, 1);
  for (int code = 0; code < 15625; ++code) {
    for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
      FoawVelocity<double> velocity;
      velocity.reset(0);
      std::vector<double> newest_first(17, 0.0);
      std::int64_t position = 0;
      for (int digit = 0, rest = code; digit < 6; ++digit, rest /= 5) {
        position += rest % 5 - 2;
        newest_first.insert(newest_first.begin(), static_cast<double>(position));
        newest_first.pop_back();
        const double estimate = velocity.update(coefficients, position, fit);
        const Choice expected = defined_choice(newest_first, 16, fit);
        ASSERT_EQ(velocity.window(), expected.window) << code << " digit " << digit;
        ASSERT_NEAR(estimate, expected.slope, 1e-12);
      }
    }
  }
}

TEST(FoawVelocity, EndFitOnAQuantizedRampKeepsTheWholeWindowAndASixteenthOfTheQuantum) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-6, 1);
  for (const double steps_per_sample : {1e-4, 0.013, 0.37, 0.5, 1.0 / 3.0, 2.71, 250.1}) {
    FoawVelocity<double> velocity;
    velocity.reset(0);
    for (int k = 1; k <= 5000; ++k) {
      const double estimate = velocity.update(
          coefficients, static_cast<std::int64_t>(std::floor(steps_per_sample * k)), FoawFit::end);
      if (k < 40) continue;
      ASSERT_EQ(velocity.window(), 16) << steps_per_sample << " sample " << k;
      ASSERT_LE(std::fabs(estimate - steps_per_sample * coefficients.scale),
                coefficients.scale / 16.0 * 1.0001);
    }
  }
}

TEST(FoawVelocity, BestFitOnAQuantizedRampIsTheBetterOfTheTwo) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-6, 1);
  double best_square = 0.0;
  double end_square = 0.0;
  FoawVelocity<double> best;
  FoawVelocity<double> end;
  best.reset(0);
  end.reset(0);
  for (int k = 1; k <= 20'000; ++k) {
    const auto count = static_cast<std::int64_t>(std::floor(0.3713 * k));
    const double truth = 0.3713 * coefficients.scale;
    const double best_error = best.update(coefficients, count, FoawFit::best) - truth;
    const double end_error = end.update(coefficients, count, FoawFit::end) - truth;
    ASSERT_LE(std::fabs(best_error), coefficients.scale / 2.0);
    best_square += best_error * best_error;
    end_square += end_error * end_error;
  }
  EXPECT_LT(best_square, end_square);
}

// One count in 10,000 ticks: the response to a single step sums to that step, for both fits.
TEST(FoawVelocity, SumsToThePathAtVeryLowSpeed) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-7, 1);
  for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
    FoawVelocity<double> velocity;
    velocity.reset(0);
    double path = 0.0;
    double highest = 0.0;
    for (int k = 1; k <= 55'000; ++k) {
      const double estimate = velocity.update(coefficients, k / 10'000, fit);
      path += 5e-5 * estimate;
      highest = std::fmax(highest, estimate);
    }
    EXPECT_NEAR(path, 5e-7, 1e-14);
    EXPECT_LT(highest, 2e-3 / 8.0);  // the bare difference would show 2 mm/s
  }
}

TEST(FoawVelocity, ReversalAtFullSpeedIsSeenInOneSample) {
  const auto coefficients = FoawVelocity<float>::prepare(16, 5e-5F, 1e-7F, 1);
  for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
    FoawVelocity<float> velocity;
    velocity.reset(0);
    std::int64_t count = 0;
    for (int k = 0; k < 50; ++k) velocity.update(coefficients, count += 500, fit);
    EXPECT_EQ(velocity.window(), 16);
    EXPECT_NEAR(velocity.update(coefficients, count -= 500, fit), -1.0F, 1e-6F);
    EXPECT_EQ(velocity.window(), 1);
    for (int k = 2; k <= 16; ++k) {
      EXPECT_NEAR(velocity.update(coefficients, count -= 500, fit), -1.0F, 1e-6F);
      EXPECT_EQ(velocity.window(), k);
    }
  }
}

TEST(FoawVelocity, SineStaysWithinAFewPercentAtFineQuanta) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-7, 1);
  for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
    FoawVelocity<double> velocity;
    velocity.reset(0);
    const double omega = 2.0 * std::numbers::pi * 5.0;
    for (int k = 1; k <= 8000; ++k) {
      const double time = k * 5e-5;
      const auto count = static_cast<std::int64_t>(std::floor(0.01 * std::sin(omega * time) / 1e-7));
      const double truth = 0.01 * omega * std::cos(omega * time);
      const double estimate = velocity.update(coefficients, count, fit);
      if (k > 20) {
        ASSERT_NEAR(estimate, truth, 0.012 * 0.01 * omega) << k;
      }
    }
  }
}

TEST(FoawVelocity, StartsOnAKnownVelocityWithAFullWindow) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-6, 1);
  for (const double steps_per_sample : {0.0, 0.3, -0.3, 7.25, -1234.5, 200'000.0}) {
    FoawVelocity<double> velocity;
    velocity.reset(coefficients, 0, steps_per_sample * coefficients.scale, 0.0);
    const auto count = static_cast<std::int64_t>(std::floor(steps_per_sample + 0.5));
    const double estimate = velocity.update(coefficients, count, FoawFit::end);
    EXPECT_NEAR(estimate, steps_per_sample * coefficients.scale, coefficients.scale / 8.0);
    EXPECT_GE(velocity.window(), 15) << steps_per_sample;
  }
}

TEST(FoawVelocity, AStartThatIsTooFastIsCutInBothDirections) {
  constexpr double fastest = 1 << 18;
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-6, 1);
  for (const double side : {1.0, -1.0}) {
    FoawVelocity<double> velocity;
    velocity.reset(coefficients, 0, side * 1e9 * coefficients.scale, 0.0);
    EXPECT_NEAR(velocity.update(coefficients, static_cast<std::int64_t>(side * fastest), FoawFit::end),
                side * fastest * coefficients.scale, coefficients.scale);
  }
}

// As if it had seen the ramp: what the start puts into the sums is what samples would have.
TEST(FoawVelocity, AStartOnAKnownVelocityLeavesTheSumsOfThatRamp) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 5e-5, 1e-6, 1);
  for (const auto fit : {FoawFit::end, FoawFit::best}) {
    FoawVelocity<double> started, ramped;
    started.reset(coefficients, 0, 8 * coefficients.scale, 0.0);
    ramped.reset(-8 * 40);
    for (int i = -39; i <= 0; ++i) (void)ramped.update(coefficients, 8 * i, fit);
    for (int i = 1; i <= 16; ++i) {
      const int jerk = i % 3 - 1;
      ASSERT_EQ(started.update(coefficients, 8 * i + jerk, fit),
                ramped.update(coefficients, 8 * i + jerk, fit))
          << i;
    }
  }
}

TEST(FoawVelocity, BeginsAsIfItHadAlwaysStoodAtZero) {
  const auto coefficients = FoawVelocity<double>::prepare(16, 1.0, 1.0, 1);
  FoawVelocity<double> fresh, reset;
  reset.reset(0);
  EXPECT_EQ(fresh.window(), 1);
  EXPECT_EQ(reset.window(), 1);
  for (const std::int64_t count : {0, 1, 1, 2, 4, 4, 3}) {
    for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
      FoawVelocity<double> one = fresh, other = reset;
      EXPECT_EQ(one.update(coefficients, count, fit), other.update(coefficients, count, fit)) << count;
    }
    EXPECT_EQ(fresh.update(coefficients, count, FoawFit::best),
              reset.update(coefficients, count, FoawFit::best));
    EXPECT_EQ(fresh.window(), reset.window());
  }
  FoawVelocity<double> standing;
  EXPECT_EQ(standing.update(coefficients, 0, FoawFit::best), 0.0);
  EXPECT_EQ(standing.window(), 16);
}

TEST(FoawVelocity, CountsBetweenTheStepsAreCarriedNotLost) {
  const auto coefficients = FoawVelocity<double>::prepare(1, 1.0, 1.0, 10);
  FoawVelocity<double> velocity;
  velocity.reset(0);
  double path = 0.0;
  for (int k = 1; k <= 1000; ++k) path += velocity.update(coefficients, 3 * k, FoawFit::best);
  EXPECT_DOUBLE_EQ(path, 3000.0);
}

TEST(FoawVelocity, AJumpBeyond32BitsEndsWithTheSampleThatMadeIt) {
  const auto coefficients = FoawVelocity<float>::prepare(16, 5e-5F, 1e-7F, 3);
  for (const FoawFit fit : {FoawFit::best, FoawFit::end}) {
    FoawVelocity<float> velocity;
    velocity.reset(0);
    EXPECT_GT(velocity.update(coefficients, std::int64_t{3} << 40, fit), 1e5F);
    EXPECT_EQ(velocity.update(coefficients, std::int64_t{3} << 40, fit), 0.0F);
  }
}

TEST(FoawVelocity, WindowsOutsideTheRangeAreTakenAsTheNearerLimit) {
  EXPECT_EQ(FoawVelocity<float>::prepare(0, 1.0F, 1.0F, 1).window, 1);
  EXPECT_EQ(FoawVelocity<float>::prepare(-7, 1.0F, 1.0F, 1).window, 1);
  EXPECT_EQ(FoawVelocity<float>::prepare(17, 1.0F, 1.0F, 1).window, 16);
  EXPECT_EQ(FoawVelocity<float>::prepare(16, 1.0F, 1.0F, 0).step, 1);
}

}  // namespace kmax::control::foaw_velocity_test
