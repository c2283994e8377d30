#include "control/winding_temperature.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "control/thermal_derating.hpp"

namespace kmax::control::winding_temperature_test {

using Model = WindingTemperature<float>;
using Config = WindingTemperatureConfig<double>;

template <typename Scalar>
WindingTemperatureConfig<Scalar> as(const Config& config) {
  return {static_cast<Scalar>(config.resistance),      static_cast<Scalar>(config.reference_temperature),
          static_cast<Scalar>(config.loss_factor),     static_cast<Scalar>(config.winding_capacity),
          static_cast<Scalar>(config.winding_to_case), static_cast<Scalar>(config.case_capacity),
          static_cast<Scalar>(config.case_to_ambient), static_cast<Scalar>(config.ambient_temperature)};
}

struct Temperatures {
  double winding, motor_case;
};

// The differential equations by classical Runge-Kutta in short steps, in double.
Temperatures integrated(const Config& config, Temperatures from, double duration, double mean_square,
                        int steps) {
  const auto rate = [&](const Temperatures& t) -> Temperatures {
    const double heat = config.loss_factor * config.resistance * mean_square *
                        (1.0 + 0.00393 * (t.winding - config.reference_temperature));
    const double flow = (t.winding - t.motor_case) / config.winding_to_case;
    return {
        (heat - flow) / config.winding_capacity,
        (flow - (t.motor_case - config.ambient_temperature) / config.case_to_ambient) / config.case_capacity};
  };
  const double h = duration / steps;
  const auto moved = [](const Temperatures& t, const Temperatures& r, double by) -> Temperatures {
    return {t.winding + by * r.winding, t.motor_case + by * r.motor_case};
  };
  for (int n = 0; n < steps; ++n) {
    const auto k1 = rate(from), k2 = rate(moved(from, k1, h / 2)), k3 = rate(moved(from, k2, h / 2)),
               k4 = rate(moved(from, k3, h));
    from.winding += h / 6 * (k1.winding + 2 * k2.winding + 2 * k3.winding + k4.winding);
    from.motor_case += h / 6 * (k1.motor_case + 2 * k2.motor_case + 2 * k3.motor_case + k4.motor_case);
  }
  return from;
}

// Heat in = heat out, with the resistance of the winding's own temperature.
Temperatures steady(const Config& config, double mean_square) {
  const double heat = config.loss_factor * config.resistance * mean_square;  // at the reference temperature
  const double through = config.winding_to_case + config.case_to_ambient;
  const double at_ambient =
      heat * (1.0 + 0.00393 * (config.ambient_temperature - config.reference_temperature));
  const double flow = at_ambient / (1.0 - 0.00393 * heat * through);
  return {config.ambient_temperature + flow * through,
          config.ambient_temperature + flow * config.case_to_ambient};
}

Config random_motor() {
  const auto in = [](double low, double high) {
    return low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0);
  };
  Config config;
  config.resistance = in(0.01, 20.0);
  config.reference_temperature = 20.0 + *rc::gen::inRange(0, 10);
  config.loss_factor = *rc::gen::element(1.0, 1.5);
  config.winding_capacity = in(0.1, 200.0);
  config.winding_to_case = in(0.05, 20.0);
  config.case_capacity = in(1.0, 5000.0);
  config.case_to_ambient = in(0.1, 50.0);
  config.ambient_temperature = *rc::gen::inRange(-20, 50);
  return config;
}

/// A mean square current that settles this far above the ambient temperature, K.
double current_for(const Config& config, double rise) {
  const double through = config.winding_to_case + config.case_to_ambient;
  const double hot = 1.0 + 0.00393 * (config.ambient_temperature + rise - config.reference_temperature);
  return rise / (through * config.loss_factor * config.resistance * hot);
}

RC_GTEST_PROP(WindingTemperature, OneStepIsTheExactSolutionWhateverItsLength, ()) {
  const Config config = random_motor();
  const double current = current_for(config, *rc::gen::inRange(1, 200));
  const Temperatures from{config.ambient_temperature + *rc::gen::inRange(0, 100),
                          config.ambient_temperature + *rc::gen::inRange(0, 60)};
  const double fastest = config.winding_to_case * std::fmin(config.winding_capacity, config.case_capacity);
  const double duration = fastest * *rc::gen::element(1e-4, 0.01, 0.3, 1.0, 5.0, 20.0);
  const auto truth = integrated(config, from, duration, current, 4000);

  WindingTemperature<double> exact;
  exact.reset(from.winding, from.motor_case);
  const double winding = exact.update(WindingTemperature<double>::prepare(config), duration, current);
  RC_ASSERT(std::fabs(winding - truth.winding) < 1e-6);
  RC_ASSERT(std::fabs(exact.motor_case() - truth.motor_case) < 1e-6);

  Model target;
  target.reset(static_cast<float>(from.winding), static_cast<float>(from.motor_case));
  target.update(Model::prepare(as<float>(config)), static_cast<float>(duration), static_cast<float>(current));
  RC_ASSERT(std::fabs(static_cast<double>(target.winding()) - truth.winding) < 2e-3);
  RC_ASSERT(std::fabs(static_cast<double>(target.motor_case()) - truth.motor_case) < 2e-3);
}

RC_GTEST_PROP(WindingTemperature, SettlesWhereTheClosedFormSays, ()) {
  const Config config = random_motor();
  const double rise = *rc::gen::inRange(1, 300);
  const double current = current_for(config, rise);
  const auto end = steady(config, current);
  RC_ASSERT(std::fabs(end.winding - config.ambient_temperature - rise) < 1e-6);
  Model model;
  model.reset(static_cast<float>(config.ambient_temperature));
  const auto c = Model::prepare(as<float>(config));
  // A thousand years at once.
  const float winding = model.update(c, 3e10f, static_cast<float>(current));
  RC_ASSERT(std::fabs(static_cast<double>(winding) - end.winding) <
            1e-4 * rise / (1.0 - 0.00393 * rise / 2) + 1e-3);
  RC_ASSERT(std::fabs(static_cast<double>(model.motor_case()) - end.motor_case) < 1e-4 * rise + 2e-3);
}

// A winding of 0.1 J/K in a case of 5 kJ/K: the step's terms are 10^5 times the temperatures they leave
// behind.
TEST(WindingTemperature, ALongStepIsRightForAFastWindingInASlowCase) {
  Config config;
  config.winding_capacity = 0.1;
  config.winding_to_case = 0.05;
  config.case_capacity = 5000.0;
  config.case_to_ambient = 50.0;
  for (const double rise : {10.0, 94.0, 290.0}) {
    const double current = current_for(config, rise);
    Model model;
    model.reset(static_cast<float>(config.ambient_temperature));
    const float winding = model.update(Model::prepare(as<float>(config)), 1e8f, static_cast<float>(current));
    const auto end = steady(config, current);
    EXPECT_NEAR(static_cast<double>(winding), end.winding, 1e-5 * rise);
    EXPECT_NEAR(static_cast<double>(model.motor_case()), end.motor_case, 1e-5 * rise);
  }
}

// 20 minutes in steps of 1 ms: each adds less than a float at 60 degC resolves.
TEST(WindingTemperature, ManySmallStepsAreAsGoodAsOne) {
  const Config config;
  const double current = 3.0;
  Model stepped, jumped;
  const auto c = Model::prepare(as<float>(config));
  stepped.reset(25.0f);
  jumped.reset(25.0f);
  for (int n = 0; n < 1'200'000; ++n) stepped.update(c, 1e-3f, static_cast<float>(current));
  jumped.update(c, 1200.0f, static_cast<float>(current));
  const auto truth = integrated(config, {25.0, 25.0}, 1200.0, current, 100000);
  EXPECT_NEAR(static_cast<double>(jumped.winding()), truth.winding, 1e-3);
  EXPECT_NEAR(static_cast<double>(stepped.winding()), truth.winding, 2e-3);
  EXPECT_NEAR(static_cast<double>(stepped.motor_case()), truth.motor_case, 2e-3);
  EXPECT_GT(truth.winding, 45.0);
}

TEST(WindingTemperature, BeginsAtRoomTemperature) {
  EXPECT_EQ(Model{}.winding(), 25.0f);
  EXPECT_EQ(Model{}.motor_case(), 25.0f);
  EXPECT_EQ(Model::highest, 1000.0f);
}

// The two time constants are seen: the winding leads at once, the case follows.
TEST(WindingTemperature, AShortPulseHeatsTheWindingAlone) {
  Model model;
  model.reset(25.0f);
  model.update(Model::prepare({}), 1.0f, 100.0f);  // 100 W into 15 J/K for 1 s
  EXPECT_NEAR(model.winding(), 25.0f + 100.0f / 15.0f, 0.15f);
  EXPECT_LT(model.motor_case(), 25.05f);
}

TEST(WindingTemperature, WithoutCurrentAllCoolsToTheAmbient) {
  Model model;
  model.reset(120.0f, 60.0f);
  const auto c = Model::prepare({});
  float last = 120.0f;
  for (int n = 0; n < 200; ++n) {
    const float now = model.update(c, 60.0f, 0.0f);
    ASSERT_LE(now, last);
    last = now;
  }
  EXPECT_NEAR(last, 25.0f, 1e-2f);
}

TEST(WindingTemperature, AboveTheCurrentThatCopperCanStandItRunsAwayAndStopsAtTheTop) {
  const Config config;
  const double critical =
      1.0 / (0.00393 * config.resistance * (config.winding_to_case + config.case_to_ambient));
  const auto c = Model::prepare(as<float>(config));
  Model model;
  model.reset(25.0f);
  // Just above: exact while it lasts.
  const auto truth = integrated(config, {25.0, 25.0}, 600.0, 1.05 * critical, 60000);
  EXPECT_NEAR(static_cast<double>(model.update(c, 600.0f, static_cast<float>(1.05 * critical))),
              truth.winding, 1e-4 * truth.winding);
  for (int n = 0; n < 10; ++n) model.update(c, 1e6f, static_cast<float>(1.05 * critical));
  EXPECT_EQ(model.winding(), Model::highest);
  EXPECT_EQ(model.update(c, 1.0f, 1e12f), Model::highest);
  // And comes back when the current ends.
  EXPECT_NEAR(model.update(c, 1e6f, 0.0f), 25.0f, 1e-2f);
}

TEST(WindingTemperature, NonsenseChangesNothingAndTakesTheCurrentAway) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const auto c = Model::prepare({});
  Model model;
  model.reset(80.0f, 40.0f);
  for (const auto& [duration, current] : {std::pair{nan, 1.0f},
                                          {1.0f, nan},
                                          {-1.0f, 1.0f},
                                          {1.0f, -1.0f},
                                          {infinity, 1.0f},
                                          {1.0f, infinity}}) {
    const float answer = model.update(c, duration, current);
    EXPECT_TRUE(std::isnan(answer));
    EXPECT_EQ(thermal_derating(answer, 100.0f, 120.0f), 0.0f);
  }
  EXPECT_EQ(model.winding(), 80.0f);
  EXPECT_EQ(model.motor_case(), 40.0f);
  EXPECT_EQ(model.update(c, 0.0f, 4.0f), 80.0f);
  for (const int which : {0, 1, 2, 3}) {
    WindingTemperatureConfig<float> broken;
    if (which == 0) broken.winding_capacity = 0.0f;
    if (which == 1) broken.case_capacity = nan;
    if (which == 2) broken.winding_to_case = 0.0f;
    if (which == 3) broken.case_to_ambient = 0.0f;
    EXPECT_TRUE(std::isnan(model.update(Model::prepare(broken), 1.0f, 1.0f))) << which;
    EXPECT_EQ(model.winding(), 80.0f);
  }
}

// With the derated current the winding stays below the limit for good, and the current that is left is the
// one that the motor can keep up there.
TEST(WindingTemperature, DeratingSettlesBelowTheLimit) {
  const Config config;
  const auto c = Model::prepare(as<float>(config));
  Model model;
  model.reset(25.0f);
  float highest = 0.0f, share = 1.0f;
  for (int n = 0; n < 200'000; ++n) {
    const float current = 10.0f * share;
    share = thermal_derating(model.update(c, 0.1f, current * current), 100.0f, 120.0f);
    highest = std::fmax(highest, model.winding());
  }
  EXPECT_LT(highest, 120.0f);
  EXPECT_NEAR(100.0 * static_cast<double>(share * share),
              current_for(config, static_cast<double>(model.winding()) - 25.0), 0.01);
}

}  // namespace kmax::control::winding_temperature_test
