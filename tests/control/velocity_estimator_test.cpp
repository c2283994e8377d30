#include "control/velocity_estimator.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "control/count_extender.hpp"
#include "control/resampler.hpp"

namespace kmax::control::velocity_estimator_test {

using Kind = VelocityEstimatorKind;
constexpr std::array<Kind, 6> kinds = {Kind::difference,   Kind::low_pass, Kind::foaw,
                                       Kind::foaw_end_fit, Kind::tracking, Kind::edge_period};

template <typename Scalar>
typename VelocityEstimator<Scalar>::Coefficients prepare(Kind kind, std::int32_t step = 1) {
  VelocityEstimatorConfig<Scalar> config;
  config.kind = kind;
  return VelocityEstimator<Scalar>::prepare(config, static_cast<Scalar>(5e-5), static_cast<Scalar>(1e-7),
                                            step);
}

std::uint32_t number(int sample) {
  return static_cast<std::uint32_t>(sample);
}

TEST(VelocityEstimator, DefaultsAreTheDocumentedOnes) {
  const VelocityEstimatorConfig<float> config;
  EXPECT_EQ(config.kind, Kind::foaw);
  EXPECT_EQ(config.window, 16);
  EXPECT_EQ(config.bandwidth, 100.0F);
}

// A steady ramp of 123.456 counts per sample is estimated by every kind once it has settled.
TEST(VelocityEstimator, EveryKindSettlesOnARamp) {
  for (const Kind kind : kinds) {
    const auto coefficients = prepare<double>(kind);
    VelocityEstimator<double> estimator;
    estimator.reset(0);
    double estimate = 0.0;
    for (int k = 1; k <= 3000; ++k) {
      estimate =
          estimator.update(coefficients, static_cast<std::int64_t>(std::floor(123.456 * k)), number(k));
    }
    EXPECT_NEAR(estimate, 123.456 * 2e-3, kind == Kind::difference ? 2e-3 : 2e-4) << static_cast<int>(kind);
  }
}

TEST(VelocityEstimator, FloatAgreesWithDouble) {
  for (const Kind kind : kinds) {
    VelocityEstimator<float> narrow;
    VelocityEstimator<double> wide;
    narrow.reset(0);
    wide.reset(0);
    const auto narrow_coefficients = prepare<float>(kind);
    const auto wide_coefficients = prepare<double>(kind);
    for (int k = 1; k <= 20'000; ++k) {
      const auto count = static_cast<std::int64_t>(std::floor(100'000.0 * std::sin(0.0031 * k)));
      ASSERT_NEAR(static_cast<double>(narrow.update(narrow_coefficients, count, number(k))),
                  wide.update(wide_coefficients, count, number(k)), 2e-6)
          << static_cast<int>(kind) << " sample " << k;
    }
  }
}

// 10 m from zero, and after what 24 h at 1 m/s amount to, the outputs are the same bits as at zero.
TEST(VelocityEstimator, NothingDependsOnTheDistanceFromZero) {
  for (const Kind kind : kinds) {
    for (const std::int64_t far : {100'000'000LL, -100'000'000LL, 864'000'000'000LL}) {
      const auto coefficients = prepare<float>(kind);
      VelocityEstimator<float> near_zero;
      VelocityEstimator<float> far_away;
      near_zero.reset(0);
      far_away.reset(far);
      for (int k = 1; k <= 3000; ++k) {
        const auto count = static_cast<std::int64_t>(std::floor(1000.0 * std::sin(0.01 * k)));
        ASSERT_EQ(near_zero.update(coefficients, count, number(k)),
                  far_away.update(coefficients, far + count, number(k)));
      }
    }
  }
}

// Beyond 10 kHz FOAW is that of every second sample, held in between; up to there of each. Whatever the
// motion.
RC_GTEST_PROP(VelocityEstimator, FoawTakesEverySecondSampleBeyond10KilohertzAlone, ()) {
  const Kind kind = *rc::gen::element(Kind::foaw, Kind::foaw_end_fit);
  const FoawFit fit = kind == Kind::foaw ? FoawFit::best : FoawFit::end;
  const bool fast = *rc::gen::arbitrary<bool>();
  const float period = fast ? 1.0F / 20'000.0F : 2.0F / 20'000.0F;
  const std::int32_t step = *rc::gen::element(1, 7, 550);
  VelocityEstimatorConfig<float> config;
  config.kind = kind;
  const auto coefficients = VelocityEstimator<float>::prepare(config, period, 1e-7F, step);
  const auto of_taken = FoawVelocity<float>::prepare(16, 1e-4F, 1e-7F, step);
  VelocityEstimator<float> estimator;
  FoawVelocity<float> foaw;
  estimator.reset(0);
  foaw.reset(0);
  std::int64_t steps = 0;
  float held = 0.0F;
  const std::int64_t most = *rc::gen::element(1, 2, 5, 300, 1 << 20);
  for (std::uint32_t k = 1; k <= 600; ++k) {
    steps += *rc::gen::inRange<std::int64_t>(-most, most + 1);
    if (!fast || k % 2 == 0) held = foaw.update(of_taken, steps * step, fit);
    RC_ASSERT(estimator.update(coefficients, steps * step, k) == held);
  }
}

// A count that leaps as far as it can in the sample that is left out and again in the next is no standstill.
TEST(VelocityEstimator, TwoLeapsAreNotTakenForNone) {
  VelocityEstimator<float> estimator;
  estimator.reset(0);
  const auto coefficients = prepare<float>(Kind::foaw);
  constexpr std::int32_t far = std::numeric_limits<std::int32_t>::max();
  for (const std::int64_t side : {1, -1}) {
    estimator.reset(0);
    (void)estimator.update(coefficients, side * far, 1);
    EXPECT_GT(static_cast<float>(side) * estimator.update(coefficients, side * far * 2, 2), 1e5F) << side;
  }
}

// The chain counter -> extension -> resampling -> estimator through 2^16, 2^32 and INT32_MIN, steps of 8
// counts.
template <typename Counter>
void chain_is_blind_to_wraps(std::int64_t start) {
  const auto resample = Resampler::prepare({8, Rounding::nearest}, start);
  for (const Kind kind : kinds) {
    for (const int direction : {1, -1}) {
      const auto coefficients = prepare<float>(kind, 8);
      CountExtender<Counter> extender;
      Resampler resampler;
      Resampler reference_resampler;
      VelocityEstimator<float> estimator;
      VelocityEstimator<float> reference;
      extender.reset(static_cast<Counter>(start), start);
      estimator.reset(resampler.update(resample, start));
      reference.reset(reference_resampler.update(resample, start));
      for (int k = 1; k <= 2000; ++k) {
        const std::int64_t count = start + direction * 17 * k;
        const float estimate = estimator.update(
            coefficients, resampler.update(resample, extender.update(static_cast<Counter>(count))),
            number(k));
        ASSERT_EQ(estimate,
                  reference.update(coefficients, reference_resampler.update(resample, count), number(k)));
        ASSERT_LT(std::fabs(estimate), 0.05F);
      }
    }
  }
}

TEST(VelocityEstimator, WrapsOfTheCounterLeaveNoTrace) {
  for (const std::int64_t start : {65536LL - 9000, 65536LL + 9000, 0LL, 9000LL})
    chain_is_blind_to_wraps<std::uint16_t>(start);
  for (const std::int64_t start :
       {4294967296LL - 9000, 4294967296LL + 9000, 2147483648LL - 9000, -2147483648LL + 9000}) {
    chain_is_blind_to_wraps<std::uint32_t>(start);
  }
}

RC_GTEST_PROP(VelocityEstimator, AChangeOfKindContinuesWithoutASpike, ()) {
  const double speed = *rc::gen::inRange(-20'000, 20'000) * 1e-3;  // counts per sample
  std::array<VelocityEstimator<float>, kinds.size()> alone;
  VelocityEstimator<float> estimator;
  estimator.reset(0);
  for (auto& one : alone) one.reset(0);
  Kind kind = Kind::foaw;
  bool edges_before = false;  // within what FOAW's window reaches back to
  float last = 0.0F;
  for (int k = 1; k <= 1500; ++k) {
    const bool settled = k > 400;
    const Kind before = kind;
    if (settled && k % 41 == 0) {
      kind = *rc::gen::elementOf(kinds);
      edges_before = before == Kind::edge_period;
    }
    const auto count = static_cast<std::int64_t>(std::floor(speed * k));
    const float estimate = estimator.update(prepare<float>(kind), count, number(k));
    std::array<float, kinds.size()> outputs{};
    for (std::size_t i = 0; i < kinds.size(); ++i)
      outputs[i] = alone[i].update(prepare<float>(kinds[i]), count, number(k));
    if (settled && kind != before) {
      const float difference = outputs[0];
      const float per_count = 2e-3F;  // m/s
      if (kind == Kind::low_pass || kind == Kind::tracking) {
        RC_ASSERT(estimate >= std::min(last, difference) - 1e-6F);
        RC_ASSERT(estimate <= std::max(last, difference) + 1e-6F);
        RC_ASSERT(std::fabs(estimate - last) <= 0.04F * std::fabs(difference - last) + 1e-6F);
      } else if (kind == Kind::edge_period || (kind != Kind::difference && edges_before)) {
        // The present sample is taken into a window along the last output.
        RC_ASSERT(estimate >= std::min(last, difference) - 0.15F * per_count);
        RC_ASSERT(estimate <= std::max(last, difference) + 0.15F * per_count);
      } else if (kind != Kind::difference && k % 2 != 0) {
        RC_ASSERT(estimate == last);  // FOAW leaves this one out
      } else {
        RC_ASSERT(estimate == outputs[static_cast<std::size_t>(kind)]);
      }
    }
    last = estimate;
  }
}

// 50 counts per sample, steps between 1 and 550 counts (0.055 mm) changed every 97 samples. A re-quantization
// moves the count by up to 550 counts, 1.1 m/s if it were taken for motion.
TEST(VelocityEstimator, AChangeOfStepInFlightIsNotTakenForMotion) {
  const std::array<std::int32_t, 6> steps = {1, 550, 3, 128, 550, 40};
  for (const Kind kind : kinds) {
    Resampler resampler;
    VelocityEstimator<float> estimator;
    Resampler::Coefficients resample;
    VelocityEstimator<float>::Coefficients coefficients;
    float last = 0.0F;
    bool started = false;
    for (std::int64_t k = 0; k < 6 * 97 * 4; ++k) {
      const std::int64_t count = 50 * k;
      const bool changed = k % 97 == 0;
      const std::int32_t step = steps[static_cast<std::size_t>(k / 97) % steps.size()];
      if (changed) {
        resample = Resampler::prepare({step, Rounding::nearest}, count - 12'345);
        coefficients = prepare<float>(kind, step);
      }
      const std::int64_t resampled = resampler.update(resample, count);
      if (!started) {
        estimator.reset(resampled);
        started = true;
      }
      const float estimate = estimator.update(coefficients, resampled, static_cast<std::uint32_t>(k));
      const float quantum = static_cast<float>(step) * 2e-3F;  // m/s
      if (changed && k > 0) {
        ASSERT_EQ(estimate, last) << static_cast<int>(kind) << " sample " << k;
      } else if (k > 600) {
        const float allowed = kind == Kind::difference ? quantum + 1e-4F : 0.25F * quantum + 0.07F;
        ASSERT_NEAR(estimate, 0.1F, allowed) << static_cast<int>(kind) << " sample " << k << " step " << step;
      }
      last = estimate;
    }
  }
}

// The same of the edge period at any velocity and any two steps, as the resampler gives them: for a window's
// length behind the change it is nearer to the velocity than the difference of two samples may be, and slow
// motions keep within half to twice.
RC_GTEST_PROP(VelocityEstimator, TheEdgePeriodGoesOnAlongItsVelocityOnAnotherStep, ()) {
  const double speed =
      *rc::gen::element(1.0, -1.0) * std::pow(10.0, *rc::gen::inRange(-1'000, 3'500) * 1e-3);  // counts
  const std::int32_t first = *rc::gen::element(1, 3, 40, 128);
  const std::int32_t second = *rc::gen::element(1, 3, 40, 128, 550);
  // Slower ones are taken for a rest, and forgotten.
  RC_PRE(std::abs(speed) * 2'000.0 > static_cast<double>(std::max(first, second)));
  const auto rounding = *rc::gen::element(Rounding::nearest, Rounding::floor, Rounding::hysteresis);
  Resampler resampler;
  VelocityEstimator<float> estimator;
  float held = 0.0F;
  constexpr int change = 8'000;
  for (int k = 0; k < change + 4'000; ++k) {
    const std::int32_t step = k < change ? first : second;
    const auto count = static_cast<std::int64_t>(std::floor(speed * k));
    const auto sample = resampler.sample(Resampler::prepare({step, rounding}, count), count);
    if (k == 0) estimator.reset(sample.count);
    const float estimate = estimator.update(prepare<float>(Kind::edge_period, step), sample, number(k));
    const double in_counts = static_cast<double>(estimate) / 2e-3;
    if (k < change) {
      held = estimate;
      continue;
    }
    if (k == change && first != second) RC_ASSERT(estimate == held);
    RC_ASSERT(in_counts * speed > 0.0);
    // Of the first step the velocity has its own error.
    const double usual = static_cast<double>(std::max(first, step)) / 16.0;
    RC_ASSERT(std::abs(in_counts - speed) <=
              std::min(static_cast<double>(step), 1.2 * std::abs(speed)) + usual);
  }
}

// What the resampler says about the steps saves the estimator working them out: the same bits either way,
// through changes of kind and step.
RC_GTEST_PROP(VelocityEstimator, TheResamplersStepsChangeNothing, ()) {
  Resampler resampler;
  VelocityEstimator<float> with_steps;
  VelocityEstimator<float> without_steps;
  std::int64_t count = 0;
  std::uint32_t samples = 0;
  bool started = false;
  for (int leg = 0; leg < 8; ++leg) {
    const Kind kind = *rc::gen::elementOf(kinds);
    const std::int32_t step = *rc::gen::element(1, 7, 550);
    const auto rounding = *rc::gen::element(Rounding::nearest, Rounding::floor, Rounding::hysteresis);
    const auto resample = Resampler::prepare({step, rounding}, count);
    const auto coefficients = prepare<float>(kind, step);
    const std::int32_t speed = *rc::gen::inRange(-2000, 2000);
    for (int k = 0; k < 40; ++k) {
      count += speed + *rc::gen::inRange(-step, step + 1);
      const auto sample = resampler.sample(resample, count);
      if (!started) {
        with_steps.reset(sample.count);
        without_steps.reset(sample.count);
        started = true;
      }
      ++samples;
      RC_ASSERT(with_steps.update(coefficients, sample, samples) ==
                without_steps.update(coefficients, sample.count, samples));
    }
  }
}

TEST(VelocityEstimator, ResetMeansStandingStill) {
  for (const Kind kind : kinds) {
    VelocityEstimator<float> estimator;
    estimator.reset(0);
    for (int k = 1; k < 100; ++k) estimator.update(prepare<float>(kind), 1000 * k, number(k));
    estimator.reset(5);
    EXPECT_EQ(estimator.update(prepare<float>(kind), 5, 0), 0.0F) << static_cast<int>(kind);
    estimator.reset(5);
    // To the edge period a first step from rest may be noise.
    const std::int64_t moved = kind == Kind::edge_period ? 7 : 6;
    EXPECT_GT(estimator.update(prepare<float>(kind), moved, 0), 0.0F) << static_cast<int>(kind);
  }
}

// Whatever the counts (jumps over the whole 64-bit range included), settings and changes between samples.
RC_GTEST_PROP(VelocityEstimator, EveryOutputIsFinite, (const std::vector<std::int64_t>& noise)) {
  VelocityEstimator<float> estimator;
  estimator.reset(*rc::gen::arbitrary<std::int64_t>());
  VelocityEstimatorConfig<float> config;
  std::int32_t step = 1;
  std::uint32_t samples = *rc::gen::inRange(0U, 2U);
  for (int leg = 0; leg < 6; ++leg) {
    config.kind = *rc::gen::elementOf(kinds);
    config.window = *rc::gen::inRange(-3, 30);
    config.bandwidth = *rc::gen::element(0.0F, -1.0F, 0.01F, 100.0F, 1e4F, 1e9F);
    step = *rc::gen::element(step, 1, 550, 1 << 20, 1 << 30);
    const auto coefficients = VelocityEstimator<float>::prepare(config, 5e-5F, 1e-7F, step);
    for (const std::int64_t count : noise)
      RC_ASSERT(std::isfinite(estimator.update(coefficients, count, ++samples)));
    const std::int64_t extreme = (1LL << 62);
    for (const std::int64_t count :
         {extreme, -extreme, extreme, std::int64_t{0}, std::int64_t{1} << 31, std::int64_t{0}}) {
      RC_ASSERT(std::isfinite(estimator.update(coefficients, count, ++samples)));
    }
  }
}

// Of velocity.estimator.
TEST(VelocityEstimator, NumbersOfTheKindsStay) {
  using enum VelocityEstimatorKind;
  int number = 0;
  for (const VelocityEstimatorKind one : {difference, low_pass, foaw, foaw_end_fit, tracking, edge_period})
    EXPECT_EQ(static_cast<int>(one), number++);
}

}  // namespace kmax::control::velocity_estimator_test
