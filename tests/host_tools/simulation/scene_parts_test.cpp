#include "host_tools/simulation/scene_parts.hpp"

#include <gtest/gtest.h>

namespace kmax::simulation::scene_parts_test {
namespace {

using Words = std::vector<std::string>;

Words parts_of(const std::string& text, std::size_t axis = 0) {
  return integrated_parts(parse_scene(text, "s").axes.at(axis));
}

TEST(SceneParts, WhatIsNotNamedDoesNotAppear) {
  EXPECT_EQ(parts_of("[device]\n"), Words{"device"});
  EXPECT_EQ(parts_of("[device]\n[motor]\nkind = \"ideal\"\n[encoder]\ncounts_per_turn = 100\n"),
            Words{"device"});
  EXPECT_EQ(parts_of("[device]\n[operator]\n"), (Words{"device", "hand and arm", "activation"}));
  EXPECT_EQ(parts_of("[device]\n[operator]\nactivation_gain = 0\n"), (Words{"device", "hand and arm"}));
  EXPECT_EQ(parts_of("[device]\ndelay = 0\n"), Words{"device"});
}

TEST(SceneParts, EveryPartInItsOrder) {
  EXPECT_EQ(parts_of("[device]\ndelay = 0.5e-3\n[structure]\n[operator]\n[encoder]\nedge_noise = "
                     "0.1\ndropout_probability = 0.01\n"),
            (Words{"device", "delay of 0.5 ms", "structure", "hand and arm", "activation", "encoder noise",
                   "encoder dropouts"}));
  EXPECT_EQ(parts_of("[device]\n[axis1.device]\n[axis1.motor]\nkind = \"pmsm\"\n", 1),
            (Words{"synchronous motor", "inverter", "supply", "device"}));
  EXPECT_EQ(parts_of("[device]\n[motor]\nkind = \"dc\"\n").front(), "DC motor");
}

TEST(SceneParts, IntegratorsInWords) {
  EXPECT_EQ(to_string(IntegratorConfig{}), "exact");
  EXPECT_EQ(to_string({.kind = IntegratorKind::rk4, .substeps = 40}), "rk4, 40 substeps per 2 ms");
  EXPECT_EQ(to_string({.kind = IntegratorKind::semi_implicit_euler}),
            "semi_implicit_euler, 10 substeps per 2 ms");
  EXPECT_EQ(to_string({.kind = IntegratorKind::adaptive, .tolerance = 1e-9}), "adaptive, tolerance 1e-09");
}

}  // namespace
}  // namespace kmax::simulation::scene_parts_test
