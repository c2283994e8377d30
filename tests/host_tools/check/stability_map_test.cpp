#include "host_tools/check/stability_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::stability_map_test {

using base::ValueError;
using device::Parameter;
using firmware::ParameterValues;
using host_tools_test::thrown_message;

std::string refusal_of(const std::string& text) {
  return thrown_message<ValueError>([&text] { parse_map_axis(text, 0); });
}

TEST(StabilityMap, ASideIsReadWithUnitsLogAndPoints) {
  const MapAxis plain = parse_map_axis("wall.stiffness=100..2e4", 0);
  EXPECT_EQ(plain.parameter, Parameter::of<"wall.stiffness">());
  EXPECT_EQ(plain.from, 100);
  EXPECT_EQ(plain.to, 20000);
  EXPECT_FALSE(plain.logarithmic);
  EXPECT_EQ(plain.points, 60u);
  const MapAxis full = parse_map_axis("wall.stiffness=0.1N/mm..10N/mm:log,41", 1);
  EXPECT_EQ(full.parameter, Parameter::of<"wall.stiffness">(1));
  EXPECT_EQ(full.from, 100);
  EXPECT_TRUE(full.logarithmic);
  EXPECT_EQ(full.points, 41u);
  EXPECT_NEAR(full.at(20), 1000, 1e-9);
  EXPECT_EQ(full.at(0), 100);
  EXPECT_EQ(full.at(40), 10000);
  EXPECT_DOUBLE_EQ(parse_map_axis("guard.damping=0..2,5", 0).at(1), 0.5);
  EXPECT_EQ(parse_map_axis("axis0.wall.position=-1..1,2", 1).at(0), -1);
}

TEST(StabilityMap, WhatIsNoSideIsRefusedWithWhatIsAllowed) {
  for (const char* text :
       {"", "wall.stiffness", "wall.stiffness=", "wall.stiffness=100", "wall.stiffness=1-2"})
    EXPECT_CONTAINS(refusal_of(text), "NAME=FROM..TO") << text;
  EXPECT_CONTAINS(refusal_of("wall.stifness=1..2"), "did you mean wall.stiffness");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=2..1"), "FROM must be below TO");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=2..2"), "FROM must be below TO");
  EXPECT_CONTAINS(refusal_of("wall.law=1..2"), "is not a real number");
  EXPECT_CONTAINS(refusal_of("encoder.counts_per_turn=1000..2000"), "is not a real number");
  EXPECT_CONTAINS(refusal_of("measured.position=0..1"), "can only be read");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=-5..1"), "below");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=0..1e7"), "1e6");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=0..10:log"), "above 0");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=1..10:ln"), "allowed is :log");
  EXPECT_CONTAINS(refusal_of("wall.stiffness=1..10,60:log"), "whole number from 2 to 1000");
  for (const char* points : {"1", "1001", "0", "-3", "4.5", "", "many", "60 "})
    EXPECT_CONTAINS(refusal_of(std::string("wall.stiffness=1..10,") + points), "from 2 to 1000") << points;
  EXPECT_NE(refusal_of("wall.stiffness=nan..10"), "");
  EXPECT_NE(refusal_of("wall.stiffness=1..inf"), "");
  EXPECT_NE(refusal_of("wall.stiffness=1...10"), "") << "three dots: .10 is a number, and below 1";
}

TEST(StabilityMap, APointIsWhatJudgingItsValuesGives) {
  ParameterValues values;
  values.set_real<"guard.friction">(0.2f);
  values.set_real<"haptic.rate">(1000);
  const control::Hand<double> hand{0.234, 540, 1.7, 147, 9.1};
  const StabilityMap map =
      map_stability(values, 0, hand, parse_map_axis("wall.stiffness=100..10000:log,7", 0),
                    parse_map_axis("guard.damping=0..5,4", 0));
  ASSERT_EQ(map.results.size(), 28u);
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 7; ++column) {
      ParameterValues point = values;
      point.set_real<"wall.stiffness">(static_cast<float>(map.x.at(column)));
      point.set_real<"guard.damping">(static_cast<float>(map.y.at(row)));
      const auto expected = control::judge_all(parameter_case(point, 0, hand));
      for (std::size_t i = 0; i < control::criterion_count; ++i) {
        EXPECT_EQ(map.at(column, row)[i].pass, expected[i].pass);
        EXPECT_EQ(map.at(column, row)[i].applies, expected[i].applies);
        EXPECT_EQ(map.at(column, row)[i].bound, expected[i].bound);
      }
    }
  }
  EXPECT_THROW(map_stability(values, 0, {}, map.x, map.x), ValueError);
}

TEST(StabilityMap, TheTableSaysWhichCriteriaPass) {
  const host_tools_test::TemporaryFolder folder;
  ParameterValues values;
  values.set_real<"guard.friction">(0.2f);
  const StabilityMap map = map_stability(values, 0, {}, parse_map_axis("wall.stiffness=100..10000:log,5", 0),
                                         parse_map_axis("guard.damping=0..5,3", 0));
  write_map_csv(map, folder / "map.csv");
  const plot::CsvTable table = plot::read_csv(folder / "map.csv");
  const auto& colgate = table.column("colgate");
  ASSERT_EQ(colgate.size(), 15u);
  EXPECT_EQ(table.column("wall.stiffness").front(), 100);
  EXPECT_EQ(table.column("guard.damping").back(), 5);
  for (std::size_t i = 0; i < 15; ++i) {
    EXPECT_EQ(colgate[i], map.results[i][0].pass ? 1 : 0);
    EXPECT_TRUE(std::isnan(table.column("resolution")[i])) << "needs guard.operator_force";
  }
  EXPECT_EQ(table.column("all")[0], 0);
  EXPECT_EQ(table.column("all")[10], 1);
  EXPECT_THROW(write_map_csv(map, folder / "none" / "map.csv"), std::runtime_error);
}

TEST(StabilityMap, ThePictureNamesCriteriaUnitsAndThePresentSet) {
  const host_tools_test::TemporaryFolder folder;
  ParameterValues values;
  values.set_real<"guard.friction">(0.2f);
  values.set_real<"guard.damping">(0.5f);
  values.set_real<"guard.operator_force">(0.3f);
  values.set_real<"guard.operator_speed">(0.2f);
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  const MapAxis x = parse_map_axis("wall.stiffness=100..50000:log,30", 0),
                y = parse_map_axis("haptic.rate=200..20000:log,30", 0);
  const StabilityMap map = map_stability(values, 0, {0.234, 540, 1.7, 147, 9.1}, x, y);
  EXPECT_TRUE(write_map_picture(map, values, "subject_1", folder / "map.svg"));
  const std::string svg = folder.read("map.svg");
  for (const char* text :
       {"wall.stiffness (N/m)", "haptic.rate (Hz)", "linear loop unstable", "colgate (guarantee)",
        "sampled_eigenvalues (necessary)", "resolution (heuristic)", "present parameters", "hand subject_1",
        "guard.damping 0.5 N s/m", "wall.law magnetic"})
    EXPECT_CONTAINS(svg, text);
  values.set_real<"wall.stiffness">(50);
  EXPECT_FALSE(write_map_picture(map, values, "subject_1", folder / "map.png"));
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(StabilityMap, AMapWithoutABorderIsDrawnToo) {
  const host_tools_test::TemporaryFolder folder;
  ParameterValues values;
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::none));
  const StabilityMap map = map_stability(values, 0, {}, parse_map_axis("wall.stiffness=1..2,2", 0),
                                         parse_map_axis("force.limit=1..2,2", 0));
  write_map_picture(map, values, "none", folder / "map.svg");
  EXPECT_CONTAINS(folder.read("map.svg"), "all criteria met");
}

}  // namespace kmax::check::stability_map_test
