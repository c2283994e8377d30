// What starts an excitation and what ends it before its time.
#include <gtest/gtest.h>

#include "firmware/drive/excitation.hpp"

namespace kmax::firmware::excitation_start_test {
namespace {

ExcitationConfig of_kind(ExcitationKind kind) {
  ExcitationConfig config;
  config.kind = kind;
  config.bias = 2.0f;
  config.ramp = 0.0f;
  return config;
}

/// Run 0 was the one before: every configuration here is another.
Excitation::Coefficients started(ExcitationConfig config) {
  ++config.run;
  return Excitation::prepare(config);
}

class ExcitationStart : public testing::Test {
 protected:
  Excitation::Output update(const ExcitationConfig& config) {
    return excitation.update(started(config), 0, 0.0f);
  }
  Excitation excitation;
};

// Only another run starts, and not one that came while it stood by.
TEST_F(ExcitationStart, StandingByStartsNothing) {
  auto config = of_kind(ExcitationKind::voltage);
  config.duration = 0.0005f;  // 10 ticks
  EXPECT_TRUE(excitation.update(Excitation::prepare(config), 0, 0.0f).finished) << "never stood by, run 0";
  for (int i = 0; i < 20; ++i) update(config);
  EXPECT_TRUE(update(config).finished);
  ++config.run;
  EXPECT_EQ(update(config).along, 2.0f);
  for (const bool another : {false, true}) {
    if (another) ++config.run;
    excitation.stand_by(started(config));
    for (int i = 0; i < 20; ++i) {
      const auto out = update(config);
      ASSERT_FALSE(out.started);
      ASSERT_TRUE(out.finished);
      ASSERT_EQ(out.along, 0.0f);
      ASSERT_EQ(out.angle, 0u);
    }
  }
  --config.run;
  const auto out = update(config);
  EXPECT_TRUE(out.started) << "any other number";
  EXPECT_EQ(out.along, 2.0f);
}

TEST_F(ExcitationStart, AnotherKindEndsTheRunSinceItsUnitIsAnother) {
  auto config = of_kind(ExcitationKind::voltage);
  for (int i = 0; i < 500; ++i) ASSERT_EQ(update(config).along, 2.0f);
  for (const ExcitationKind kind : {ExcitationKind::current, ExcitationKind::voltage}) {
    config.kind = kind;
    for (int i = 0; i < 10; ++i) {
      const auto out = update(config);
      ASSERT_FALSE(out.started);
      ASSERT_TRUE(out.finished);
      ASSERT_EQ(out.along, 0.0f) << "also when it is the first kind again";
    }
  }
  ++config.run;
  EXPECT_EQ(update(config).along, 2.0f);
}

TEST_F(ExcitationStart, AnotherRunStartsAnewInMidRamp) {
  auto config = of_kind(ExcitationKind::voltage);
  config.ramp = 0.01f;
  config.angle_rate = 100.0f;
  config.angle_span = 1.0f;
  config.alternation = 1.0f;
  config.half_period = 30;
  for (int i = 0; i < 140; ++i) update(config);
  config.run = 65'535;
  auto out = update(config);
  EXPECT_TRUE(out.started);
  EXPECT_EQ(out.along, 0.0f);
  EXPECT_EQ(out.angle, 0u);
  out = update(config);
  EXPECT_FALSE(out.started);
  EXPECT_NEAR(out.along, 3.0f / 200.0f, 1e-6f) << "the square wave begins with its positive half again";
}

}  // namespace
}  // namespace kmax::firmware::excitation_start_test
