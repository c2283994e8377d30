#include "host_tools/wall/wall_evaluation.hpp"

#include <gtest/gtest.h>

#include "host_tools/plot/figure.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::wall::force_curve_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

TEST(ForceCurves, PictureNamesTheWallAndItsLaws) {
  const TemporaryFolder folder;
  firmware::ParameterValues values;
  values.set_real<"wall.stiffness">(8410.0f, 1);
  values.set_real<"wall.magnetic_coefficient">(1.5f, 1);
  write_force_curves(values, 1, folder / "laws.svg");
  const std::string picture = folder.read("laws.svg");
  for (const char* text : {"8.41 N/mm", "plain", "F_MC = 1.5 N", "adaptive, at rest", "0.5 m/s", "</svg>"})
    EXPECT_CONTAINS(picture, text);
}

// No stiffness, the other side, a wall far away: nothing to divide by, nothing to draw upside down.
TEST(ForceCurves, ExtremeWallsCanBeDrawn) {
  const TemporaryFolder folder;
  firmware::ParameterValues values;
  values.set_real<"wall.stiffness">(0.0f);
  values.set_whole<"wall.side">(-1);
  values.set_real<"wall.position">(1.0f);
  write_force_curves(values, 0, folder / "soft.svg");
  values.set_real<"wall.stiffness">(1e6f);
  write_force_curves(values, 0, folder / "hard.svg");
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(ForceCurves, ErrorsAreTheFigures) {
  const TemporaryFolder folder;
  EXPECT_CONTAINS(
      thrown_message<plot::FigureError>([&] { write_force_curves({}, 0, folder / "no/laws.svg"); }),
      "does not exist");
}

}  // namespace kmax::wall::force_curve_test
