#include "control/interference.hpp"

#include <gtest/gtest.h>

namespace kmax::control::interference_test {

TEST(Interference, PerpendicularIsEquationTwo) {
  Interference<double> interference;
  const auto c = Interference<double>::prepare({InterferenceMode::perpendicular, 5.0, 3.0, 0.0}, 0.002);
  EXPECT_EQ(interference.update(c, false).normal, 3.0);
  EXPECT_EQ(interference.update(c, true).normal, 8.0);
  EXPECT_EQ(interference.update(c, true).tangential, 0.0);
  EXPECT_EQ(interference.background(c), 3.0) << "without F_I";
  interference.update(c, false);
  EXPECT_EQ(interference.background(c), 3.0);
}

TEST(Interference, ParallelIsEquationFour) {
  Interference<double> interference;
  const auto c = Interference<double>::prepare({InterferenceMode::parallel, 5.0, 3.0, 0.1}, 0.002);
  for (int contact = 0; contact < 2; ++contact) {
    EXPECT_EQ(interference.update(c, false).normal, 0.0);
    EXPECT_EQ(interference.update(c, false).tangential, 0.0);
    EXPECT_EQ(interference.background(c), 0.0);
    for (int sample = 0; sample < 100; ++sample) {
      const auto out = interference.update(c, true);
      EXPECT_EQ(out.tangential, 5.0);
      EXPECT_EQ(out.normal, sample < 50 ? 0.0 : 3.0) << "sample " << sample;
      EXPECT_EQ(interference.background(c), out.normal) << "sample " << sample;
    }
  }
}

TEST(Interference, OnsetIsAWholeNumberOfSamplesInFloatToo) {
  // 0.1 / 0.002 is 50.000001 or 49.999996 by rounding; both must mean 50 samples.
  for (const float period : {0.002f, 0.001f, 5e-5f, 0.0005f}) {
    const auto c = Interference<float>::prepare({InterferenceMode::parallel, 1.0f, 1.0f, 0.1f}, period);
    EXPECT_NEAR(static_cast<double>(c.onset_samples), 0.1 / static_cast<double>(period), 0.51) << period;
  }
  EXPECT_EQ(
      Interference<float>::prepare({InterferenceMode::parallel, 1.0f, 1.0f, 0.1f}, 0.002f).onset_samples,
      50u);
}

TEST(Interference, AnAbsurdOnsetNeverComesAndNeverWraps) {
  const auto c = Interference<float>::prepare({InterferenceMode::parallel, 1.0f, 1.0f, 1e30f}, 5e-5f);
  EXPECT_EQ(c.onset_samples, 0x80000000u);
}

TEST(Interference, AResetBeginsTheTimeOfTheContactAnew) {
  Interference<double> interference;
  const auto c = Interference<double>::prepare({InterferenceMode::parallel, 5.0, 3.0, 0.004}, 0.002);
  for (int sample = 0; sample < 5; ++sample) interference.update(c, true);
  EXPECT_EQ(interference.background(c), 3.0);
  interference.reset();
  EXPECT_EQ(interference.background(c), 0.0);
  for (const double normal : {0.0, 0.0, 3.0}) EXPECT_EQ(interference.update(c, true).normal, normal);
}

TEST(Interference, TheOnsetIsRoundedUpAndBounded) {
  const auto samples = [](double onset, double period = 1.0) {
    return Interference<double>::prepare({InterferenceMode::parallel, 1.0, 1.0, onset}, period).onset_samples;
  };
  EXPECT_EQ(samples(-1.0), 0u);
  EXPECT_EQ(samples(0.0), 0u);
  EXPECT_EQ(samples(0.5), 1u);
  EXPECT_EQ(samples(2.0), 2u);
  EXPECT_EQ(samples(2.0009), 2u) << "within a thousandth";
  EXPECT_EQ(samples(2.0011), 3u);
  EXPECT_EQ(samples(2147483647.0), 0x7FFF'FFFFu);
  EXPECT_EQ(samples(2147483648.0), 0x8000'0000u);
  EXPECT_EQ(samples(4294967296.0), 0x8000'0000u);
}

TEST(Interference, NoneDoesNothing) {
  Interference<float> interference;
  const auto c = Interference<float>::prepare({InterferenceMode::none, 5.0f, 3.0f, 0.0f}, 0.002f);
  EXPECT_EQ(interference.update(c, true).normal, 0.0f);
  EXPECT_EQ(interference.update(c, true).tangential, 0.0f);
  EXPECT_EQ(interference.background(c), 0.0f);
}

}  // namespace kmax::control::interference_test
