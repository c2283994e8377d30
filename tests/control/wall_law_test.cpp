#include "control/wall_law.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "firmware/object_dictionary/axis_groups.hpp"

namespace kmax::control::wall_law_test {

template <typename Scalar>
Scalar force_at(const WallLawConfig<Scalar>& config, Scalar outside_distance,
                Scalar outward_velocity = Scalar(0)) {
  WallLaw<Scalar> law;
  return law.update(WallLaw<Scalar>::prepare(config, Scalar(0.002)), outside_distance, outward_velocity)
      .force;
}

template <typename Scalar>
WallLawConfig<Scalar> magnetic(Scalar stiffness, Scalar coefficient, Scalar length) {
  WallLawConfig<Scalar> config;
  config.kind = WallKind::magnetic;
  config.stiffness = stiffness;
  config.magnetic_coefficient = coefficient;
  config.magnetic_length = length;
  return config;
}

// Distance in representable numbers between two floats.
std::int64_t ulp_distance(float a, float b) {
  const auto ordered = [](float value) {
    const auto bits = static_cast<std::int64_t>(std::bit_cast<std::int32_t>(value));
    return bits < 0 ? std::int64_t{INT32_MIN} - bits : bits;
  };
  return std::abs(ordered(a) - ordered(b));
}

struct Point {
  double outside_distance, force;
};

// Impedance tuning with F_MC = 2 N, x_0 = 1 mm, K = 8.41 N/mm: eq. 6 worked by hand as fractions.
TEST(WallLaw, MeetsTheTestValues) {
  const auto config = magnetic<double>(8410, 2, 0.001);
  for (const Point& point :
       {Point{0.009, 2.0 / 100.0}, {0.002, 2.0 / 9.0}, {0.001, 0.5}, {0.0, 2.0}, {-0.0001, 2.841}})
    EXPECT_NEAR(force_at(config, point.outside_distance), point.force, 1e-6 * point.force)
        << "at " << point.outside_distance << " m";
}

TEST(WallLaw, FloatStaysWithinFourUlpOfDoubleOverTheWholeField) {
  const auto in_float = magnetic<float>(8410.0f, 2.0f, 0.001f);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> distances(-0.01f, 0.1f);
  for (int i = 0; i < 200000; ++i) {
    const float d = distances(random);
    const double wide = static_cast<double>(d);
    const double exact =
        wide > 0 ? 2.0 / std::pow(wide / static_cast<double>(0.001f) + 1.0, 2) : 2.0 + 8410.0 * -wide;
    ASSERT_LE(ulp_distance(force_at(in_float, d), static_cast<float>(exact)), 4) << "at " << d;
  }
}

TEST(WallLaw, PlainWallIsTheOneSidedSpringOfEquationThree) {
  WallLawConfig<double> config;
  config.kind = WallKind::plain;
  config.stiffness = 5500;
  EXPECT_EQ(force_at(config, 0.001), 0.0);
  EXPECT_EQ(force_at(config, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(force_at(config, -0.001), 5.5);
}

TEST(WallLaw, NoneMakesNoForceButKnowsInsideFromOutside) {
  WallLawConfig<double> config;
  config.kind = WallKind::none;
  WallLaw<double> law;
  const auto coefficients = WallLaw<double>::prepare(config, 0.002);
  EXPECT_EQ(law.update(coefficients, -0.01, -1).force, 0.0);
  EXPECT_TRUE(law.update(coefficients, -0.01, -1).inside);
  EXPECT_FALSE(law.update(coefficients, 0.01, -1).inside);
}

TEST(WallLaw, DampingActsInsideOnlyAndNeverPulls) {
  auto config = magnetic<double>(1000, 2, 0.001);
  config.damping = 10;
  EXPECT_DOUBLE_EQ(force_at(config, 0.001, -1.0), 0.5) << "outside";
  EXPECT_DOUBLE_EQ(force_at(config, -0.001, -0.1), 2 + 1 + 1) << "pushing in";
  EXPECT_DOUBLE_EQ(force_at(config, -0.001, 0.05), 2 + 1 - 0.5) << "moving out";
  EXPECT_DOUBLE_EQ(force_at(config, -0.001, 100.0), 2.0) << "moving out fast: the field alone is left";
}

RC_GTEST_PROP(WallLaw, MagneticForceIsContinuousThroughTheSurface, ()) {
  const double coefficient = *rc::gen::map(rc::gen::inRange(0, 100000), [](int n) { return n * 1e-3; });
  const double length = *rc::gen::map(rc::gen::inRange(1, 1000000), [](int n) { return n * 1e-6; });
  const auto config = magnetic<double>(1e6, coefficient, length);
  const double step = length * 1e-9;
  // The slope outside is at most 2 F_MC / x_0, the slope inside K: nothing else may show over a small step.
  const double bound = step * (2 * coefficient / length + 1e6) * (1 + 1e-6) + 1e-12;
  RC_ASSERT(std::abs(force_at(config, step) - force_at(config, 0.0)) <= bound);
  RC_ASSERT(std::abs(force_at(config, -step) - force_at(config, 0.0)) <= bound);
}

RC_GTEST_PROP(WallLaw, ForceNeverFallsOnTheWayIn, ()) {
  const auto number = [](int low, int high, double scale) {
    return *rc::gen::map(rc::gen::inRange(low, high), [scale](int n) { return n * scale; });
  };
  const auto config =
      magnetic<float>(static_cast<float>(number(0, 1000000, 1)), static_cast<float>(number(0, 100000, 1e-3)),
                      static_cast<float>(number(1, 1000000, 1e-6)));
  const auto far = static_cast<float>(number(-1000000, 1000000, 1e-7));
  const auto near = far - static_cast<float>(number(0, 1000000, 1e-9));
  RC_ASSERT(force_at(config, near) >= force_at(config, far));
}

RC_GTEST_PROP(WallLaw, EveryFiniteInputGivesAFiniteForce, ()) {
  const auto any_finite = [] {
    return *rc::gen::suchThat(rc::gen::map(rc::gen::arbitrary<std::uint32_t>(),
                                           [](std::uint32_t bits) { return std::bit_cast<float>(bits); }),
                              [](float v) { return std::isfinite(v); });
  };
  WallLawConfig<float> config;
  config.kind =
      static_cast<WallKind>(*rc::gen::inRange<std::size_t>(0, std::size(firmware::names::wall_law)));
  config.stiffness = std::abs(any_finite());
  config.damping = std::abs(any_finite());
  config.magnetic_coefficient = std::abs(any_finite());
  config.magnetic_length = std::abs(any_finite());
  config.adaptive.gain = std::abs(any_finite());
  config.adaptive.offset = std::abs(any_finite());
  config.adaptive.velocity_max = std::abs(any_finite());
  config.adaptive.force_min = 0.8f;
  config.adaptive.force_max = std::numeric_limits<float>::max();
  config.adaptive.relation =
      *rc::gen::element(AdaptiveRelation::linear, AdaptiveRelation::square, AdaptiveRelation::square_root);
  config.adaptive.mode =
      *rc::gen::element(AdaptiveMode::instant, AdaptiveMode::latched, AdaptiveMode::peak_hold);
  RC_PRE(config.magnetic_length > 0.0f && config.adaptive.velocity_max > 0.0f);
  WallLaw<float> law;
  const auto coefficients = WallLaw<float>::prepare(config, 5e-5f);
  for (int i = 0; i < 4; ++i) {
    const auto out = law.update(coefficients, any_finite(), any_finite());
    RC_ASSERT(std::isfinite(out.force));
    RC_ASSERT(out.force >= 0.0f);
    RC_ASSERT(std::isfinite(out.magnetic_force));
  }
}

TEST(WallLaw, SurvivesATinyFieldLengthAndAHugeStiffness) {
  EXPECT_EQ(force_at(magnetic<float>(1e6f, 2.0f, 1e-6f), 0.1f),
            2.0f / ((0.1f * 1e6f + 1) * (0.1f * 1e6f + 1)));
  EXPECT_EQ(force_at(magnetic<float>(0.0f, 2.0f, 1e-44f), 1.0f), 0.0f)
      << "x_0 below the smallest normal number";
  EXPECT_EQ(force_at(magnetic<float>(1e38f, 2.0f, 1e-3f), -1e9f), std::numeric_limits<float>::max());
  EXPECT_EQ(force_at(magnetic<double>(1e6, 2, 1e-3), -1.0), 1e6 + 2);
}

TEST(WallLaw, NotANumberIsNotHidden) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(force_at(magnetic<float>(1000.0f, 2.0f, 1e-3f), nan)));
  auto damped = magnetic<float>(1000.0f, 2.0f, 1e-3f);
  damped.damping = 1.0f;
  EXPECT_TRUE(std::isnan(force_at(damped, -1e-3f, nan)));
}

TEST(WallLaw, AResetForgetsTheContact) {
  WallLawConfig<double> config;
  config.kind = WallKind::adaptive;
  config.adaptive.mode = AdaptiveMode::latched;
  WallLaw<double> law;
  const auto c = WallLaw<double>::prepare(config, 0.002);
  EXPECT_NEAR(law.update(c, -1e-6, -1.0).magnetic_coefficient, 1.8, 1e-12);
  EXPECT_NEAR(law.update(c, -1e-6, -0.1).magnetic_coefficient, 1.8, 1e-12);
  law.reset();
  EXPECT_NEAR(law.update(c, -1e-6, -0.1).magnetic_coefficient, 0.9, 1e-12);
}

}  // namespace kmax::control::wall_law_test
