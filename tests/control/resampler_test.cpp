#include "control/resampler.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace kmax::control::resampler_test {

// The parameter's values.
static_assert(static_cast<int>(Rounding::nearest) == 0 && static_cast<int>(Rounding::floor) == 1 &&
              static_cast<int>(Rounding::hysteresis) == 2);

__extension__ using Wide = __int128;

// Independent of the implementation: whole numbers of 128 bits, straight from the definitions.
std::int64_t floor_multiple(std::int64_t count, std::int64_t step) {
  std::int64_t quotient = count / step;
  if (count % step != 0 && count < 0) --quotient;
  return quotient * step;
}
std::int64_t nearest_multiple(std::int64_t count, std::int64_t step) {
  const Wide twice = 2 * Wide{count} + step;  // floor((2 count + step) / (2 step))
  Wide quotient = twice / (2 * Wide{step});
  if (twice < 0 && twice % (2 * Wide{step}) != 0) --quotient;
  return static_cast<std::int64_t>(quotient * step);
}

class Reference {
 public:
  std::int64_t update(const ResamplerConfig& config, std::int64_t count) {
    const bool fresh = config.step != step_;
    step_ = config.step;
    if (config.rounding == Rounding::floor) return held_ = floor_multiple(count, step_);
    const std::int64_t away = count > held_ ? count - held_ : held_ - count;
    if (config.rounding == Rounding::hysteresis && !fresh && away < step_) return held_;
    return held_ = nearest_multiple(count, step_);
  }

 private:
  std::int64_t held_ = 0;
  std::int64_t step_ = 0;
};

std::int64_t once(std::int32_t step, Rounding rounding, std::int64_t count) {
  Resampler resampler;
  return resampler.update(Resampler::prepare({step, rounding}, count), count);
}

TEST(Resampler, TiesGoToTheLargerMultiple) {
  for (std::int64_t count = -6; count <= 6; ++count) {
    const std::int64_t expected = count < -2 ? -4 : count < 2 ? 0 : count < 6 ? 4 : 8;
    EXPECT_EQ(once(4, Rounding::nearest, count), expected) << count;
  }
  for (std::int64_t count = -7; count <= 7; ++count) {
    EXPECT_EQ(once(5, Rounding::nearest, count), count < -2 ? -5 : count <= 2 ? 0 : 5) << count;
  }
}

TEST(Resampler, HysteresisIgnoresDitherAndMovesAfterAFullStep) {
  const auto coefficients = Resampler::prepare({10, Rounding::hysteresis}, 0);
  Resampler resampler;
  EXPECT_EQ(resampler.update(coefficients, 4), 0);
  for (const std::int64_t count : {9, -9, 5, 6, -5, -6, 9})
    EXPECT_EQ(resampler.update(coefficients, count), 0) << count;
  EXPECT_EQ(resampler.update(coefficients, 10), 10);
  EXPECT_EQ(resampler.update(coefficients, 1), 10);
  EXPECT_EQ(resampler.update(coefficients, 0), 0);
  EXPECT_EQ(resampler.update(coefficients, -10), -10);
  EXPECT_EQ(resampler.update(coefficients, 26), 30);
}

TEST(Resampler, StepsOutsideTheRangeAreTakenAsTheNearerLimit) {
  EXPECT_EQ(Resampler::prepare({0, Rounding::nearest}, 7).step, 1);
  EXPECT_EQ(Resampler::prepare({std::numeric_limits<std::int32_t>::min(), Rounding::nearest}, 7).step, 1);
  EXPECT_EQ(Resampler::prepare({std::numeric_limits<std::int32_t>::max(), Rounding::nearest}, 7).step,
            1 << 30);
}

TEST(Resampler, AfterAResetTheFirstSampleIsOfAnyGridFromItsAnchor) {
  for (const std::int32_t step : {1, 2, 10}) {
    const ResamplerConfig config{step, Rounding::hysteresis};
    Resampler resampler;
    EXPECT_EQ(resampler.update(Resampler::prepare(config, 1000), 1000), 1000);
    resampler.reset();
    // So far that whoever still held 1000 would have to catch up.
    constexpr std::int64_t far = 1LL << 40;
    EXPECT_EQ(resampler.update(Resampler::prepare(config, far), far), nearest_multiple(far, step));
    EXPECT_EQ(resampler.update(Resampler::prepare(config, far), far + 2 * step),
              nearest_multiple(far + 2 * step, step));
  }
}

// A jump beyond the precondition: on the grid at every sample, caught up at 2^31 counts per sample.
TEST(Resampler, CatchesUpWithAJumpBeyondThePrecondition) {
  for (const Rounding rounding : {Rounding::nearest, Rounding::floor, Rounding::hysteresis}) {
    Resampler resampler;
    const auto coefficients = Resampler::prepare({550, rounding}, 0);
    resampler.update(coefficients, 0);
    for (const std::int64_t target : {40'000'000'000LL, -40'000'000'123LL}) {
      std::int64_t output = 0;
      for (int i = 0; i < 40; ++i) {
        output = resampler.update(coefficients, target);
        ASSERT_EQ(output % 550, 0);
      }
      const std::int64_t away = output > target ? output - target : target - output;
      EXPECT_LT(away, 550);
      if (rounding == Rounding::floor) {
        EXPECT_EQ(output, floor_multiple(target, 550));
      }
    }
  }
}

// Random walks with changes of step and rounding in flight, around a centre up to 2^61 from zero.
RC_GTEST_PROP(Resampler, MatchesTheDefinitionOnRandomWalks, ()) {
  const auto step =
      rc::gen::map(rc::gen::pair(rc::gen::inRange(0, 21), rc::gen::inRange(0, 1 << 20)),
                   [](const std::pair<int, int>& p) { return 1 + (p.second & ((1 << p.first) - 1)); });
  const std::int64_t centre = *rc::gen::element<std::int64_t>(
      0, 0, -1, 1, 100'000'000, -100'000'000, 1LL << 31, -(1LL << 31), 1LL << 32, 1LL << 61, -(1LL << 61));
  const int stride_bits = *rc::gen::inRange(1, 31);
  Resampler resampler;
  Reference reference;
  std::int64_t count = centre;
  for (int leg = 0; leg < 8; ++leg) {
    const ResamplerConfig config{*step,
                                 *rc::gen::element(Rounding::nearest, Rounding::floor, Rounding::hysteresis)};
    const std::int64_t anchor_near = count + *rc::gen::inRange(-(1 << 29), 1 << 29);
    const auto coefficients = Resampler::prepare(config, anchor_near);
    for (const std::uint32_t random : *rc::gen::container<std::vector<std::uint32_t>>(
             40, rc::gen::resize(1000, rc::gen::arbitrary<std::uint32_t>()))) {
      const std::int64_t range = 1LL << stride_bits;
      count += static_cast<std::int64_t>(random % static_cast<std::uint64_t>(range)) - range / 2;
      const std::int64_t output = resampler.update(coefficients, count);
      RC_ASSERT(output == reference.update(config, count));
      RC_ASSERT(output % config.step == 0);
    }
  }
}

RC_GTEST_PROP(Resampler, DitherOfLessThanAStepNeverTogglesTheHysteresis, (std::int32_t centre)) {
  const std::int32_t step = *rc::gen::inRange(2, 1 << 20);
  Resampler resampler;
  const auto coefficients = Resampler::prepare({step, Rounding::hysteresis}, centre);
  const std::int64_t held = resampler.update(coefficients, centre);
  for (int i = 0; i < 50; ++i) {
    const std::int64_t dither = *rc::gen::inRange(-(step - 1), step);
    RC_ASSERT(resampler.update(coefficients, held + dither) == held);
  }
  RC_ASSERT(resampler.update(coefficients, held + step) == held + step);
}

// sample() gives what update() gives, and its steps add up to the way made on the grid.
RC_GTEST_PROP(Resampler, TheStepsAreTheWayOnTheGrid, ()) {
  const std::int32_t step = *rc::gen::element(1, 2, 3, 10, 550, 1 << 20);
  const auto rounding = *rc::gen::element(Rounding::nearest, Rounding::floor, Rounding::hysteresis);
  std::int64_t count = *rc::gen::element<std::int64_t>(0, -1, 1LL << 40);
  const auto coefficients = Resampler::prepare({step, rounding}, count);
  Resampler sampled;
  Resampler updated;
  std::int64_t last = sampled.sample(coefficients, count).count;
  RC_ASSERT(last == updated.update(coefficients, count));
  for (const std::int32_t move :
       *rc::gen::container<std::vector<std::int32_t>>(60, rc::gen::inRange(-5000, 5000))) {
    count += *rc::gen::element(move, move % 7, move * 1000, 0);
    const auto sample = sampled.sample(coefficients, count);
    RC_ASSERT(sample.count == updated.update(coefficients, count));
    RC_ASSERT(sample.count == last + std::int64_t{sample.steps} * step);
    last = sample.count;
  }
}

TEST(ResamplerStep, NearestWholeNumberOfCounts) {
  EXPECT_EQ(resampler_step(0.0, 1e-6), 1);
  EXPECT_EQ(resampler_step(55e-6, 1e-7), 550);
  EXPECT_EQ(resampler_step(0.4e-3, 23e-6), 17);  // 17.39
  EXPECT_EQ(resampler_step(1.5e-6, 1e-6), 2);
  EXPECT_EQ(resampler_step(1.49e-6, 1e-6), 1);
  EXPECT_EQ(resampler_step(1e-9, 1e-6), 1);  // finer than the encoder: the encoder's own
}

TEST(ResamplerStep, NonsenseAndExcessAreBounded) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(resampler_step(-1.0, 1e-6), 1);
  EXPECT_EQ(resampler_step(nan, 1e-6), 1);
  EXPECT_EQ(resampler_step(1e-3, nan), 1);
  EXPECT_EQ(resampler_step(1e-3, 0.0), 1);
  EXPECT_EQ(resampler_step(1e-3, -1.0), 1);
  EXPECT_EQ(resampler_step(infinity, 1e-6), resampler_step_max);
  EXPECT_EQ(resampler_step(infinity, infinity), 1);
  EXPECT_EQ(resampler_step(1e9, 1e-9), resampler_step_max);
}

}  // namespace kmax::control::resampler_test
