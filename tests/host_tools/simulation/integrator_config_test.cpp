#include "host_tools/simulation/integrator_config.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::simulation::integrator_config_test {
namespace {

using host_tools_test::thrown_message;

TEST(IntegratorConfig, TheDefaultIsTheExactMethodAndIsAllowed) {
  const IntegratorConfig config;
  EXPECT_EQ(config.kind, IntegratorKind::exact);
  EXPECT_NO_THROW(validate(config));
}

TEST(IntegratorConfig, NamesStandInTheOrderOfTheKinds) {
  const auto name_of = [](IntegratorKind kind) { return integrator_names[static_cast<std::size_t>(kind)]; };
  EXPECT_EQ(name_of(IntegratorKind::exact), "exact");
  EXPECT_EQ(name_of(IntegratorKind::semi_implicit_euler), "semi_implicit_euler");
  EXPECT_EQ(name_of(IntegratorKind::rk4), "rk4");
  EXPECT_EQ(name_of(IntegratorKind::adaptive), "adaptive");
}

TEST(IntegratorConfig, ValuesOutOfRangeAreRefusedByName) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double substeps : {0.0, 0.99, -1.0, 1.1e6, nan}) {
    IntegratorConfig config;
    config.substeps = substeps;
    EXPECT_CONTAINS(thrown_message<std::invalid_argument>([&] { validate(config); }), "integrator.substeps");
  }
  for (const double tolerance : {0.0, 0.9e-14, 0.011, -1e-6, nan}) {
    IntegratorConfig config;
    config.tolerance = tolerance;
    EXPECT_CONTAINS(thrown_message<std::invalid_argument>([&] { validate(config); }), "integrator.tolerance");
  }
  for (const auto& [substeps, tolerance] : {std::pair(1.0, 1e-14), std::pair(1e6, 1e-2)}) {
    IntegratorConfig config;
    config.substeps = substeps;
    config.tolerance = tolerance;
    EXPECT_NO_THROW(validate(config));
  }
}

}  // namespace
}  // namespace kmax::simulation::integrator_config_test
