#include "host_tools/experiment/max_stiffness/max_stiffness_pictures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::max_stiffness_pictures_test {
namespace {

const std::vector<double> as_in_the_paper{3580, 4000, 5000, 7000, 8410, 8020, 6000, 6000};

TEST(MaxStiffnessFigure, ShowsAllOfTheData) {
  std::vector<double> high = as_in_the_paper;
  high[4] = 17300.0;
  for (const std::vector<double>& means :
       {as_in_the_paper, high, std::vector<double>{100, 200, 300, 400, 500}}) {
    const plot::Figure figure = max_stiffness_figure({made_up_study(means, true)});
    ASSERT_EQ(figure.panels.size(), 1U);
    const plot::Panel& panel = figure.panels[0];
    ASSERT_TRUE(panel.y_limits);
    double top = 0.0;
    for (const plot::Series& series : panel.series) {
      for (const double y : series.y) {
        if (std::isnan(y)) continue;
        EXPECT_GE(y, panel.y_limits->first);
        EXPECT_LT(y, panel.y_limits->second);
        top = std::max(top, y);
      }
    }
    // And not much else: the paper's own numbers are always there.
    EXPECT_GE(top, 8.41);
    EXPECT_LE(panel.y_limits->second, 1.05 * top + 1.0);
  }
}

TEST(MaxStiffnessFigure, TheAdaptiveWallStandsFromItsWorstModeToItsBest) {
  const plot::Figure figure = max_stiffness_figure({made_up_study(as_in_the_paper, true)});
  const plot::Series& modes = figure.panels[0].series.back();
  EXPECT_CONTAINS(modes.label, "adaptive");
  EXPECT_EQ(modes.y, (std::vector<double>{6.0, 8.02}));
  // Without an adaptive condition there is nothing to stand there.
  const plot::Figure constant = max_stiffness_figure({made_up_study({3580, 4000, 5000, 7000, 8410}, true)});
  EXPECT_EQ(constant.panels[0].series.size(), 2U);
}

TEST(MaxStiffnessCaption, SaysCalibratedOnlyOfWhatWasFitted) {
  EXPECT_CONTAINS(max_stiffness_caption({made_up_study(as_in_the_paper, true)}),
                  "The values at 0 and 2 N (force clipped at 3.3 N) are calibrated");
  const std::string predicted = max_stiffness_caption({made_up_study(as_in_the_paper, false)});
  EXPECT_EQ(predicted.find("calibrated"), std::string::npos) << predicted;
  EXPECT_CONTAINS(predicted, "nothing was fitted");
  const std::string mixed = max_stiffness_caption(
      {made_up_study(as_in_the_paper, false), made_up_study(as_in_the_paper, true, 0.0)});
  EXPECT_CONTAINS(mixed, "The values at 0 and 2 N (force not clipped) are calibrated");
}

TEST(DrawMaxStiffness, WritesAPicture) {
  const host_tools_test::TemporaryFolder folder;
  const report::Picture picture =
      draw_max_stiffness({made_up_study(as_in_the_paper, true)}, folder / "a.svg");
  EXPECT_EQ(picture.file, folder / "a.svg");
  EXPECT_EQ(picture.caption, max_stiffness_caption({made_up_study(as_in_the_paper, true)}));
  EXPECT_CONTAINS(folder.read("a.svg"), "constant, clipped");
  EXPECT_THROW(draw_max_stiffness({made_up_study(as_in_the_paper, true)}, folder / "none" / "a.svg"),
               plot::FigureError);
}

TEST(DrawRates, ShowsOneEncoderAndMeasureOnly) {
  const host_tools_test::TemporaryFolder folder;
  RateResult shown{{.rate = 1000.0, .count_length = 55e-6}, found_stiffness(7000.0)};
  RateResult other{{.rate = 1000.0, .count_length = 5.5e-6, .delay = 0.5e-3}, found_stiffness(7000.0)};
  const report::Picture picture = draw_rates({shown, other}, 55e-6, RateMeasure::moves, folder / "r.svg");
  EXPECT_CONTAINS(picture.caption, "Encoder of 55 um, unstable: moves by 3 counts");
  const std::string drawn = folder.read("r.svg");
  EXPECT_CONTAINS(drawn, name_of(shown.setting));
  EXPECT_EQ(drawn.find(name_of(other.setting)), std::string::npos);
}

}  // namespace
}  // namespace kmax::experiment::max_stiffness_pictures_test
