#include "host_tools/experiment/max_stiffness/max_stiffness_report.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::max_stiffness_report_test {

const std::vector<double> as_in_the_paper{3580, 4000, 5000, 7000, 8410, 8020, 6000, 6000};

#define EXPECT_LACKS(text, part) \
  EXPECT_EQ(std::string(text).find(part), std::string::npos) << "'" << (text) << "' has '" << (part) << "'"

std::string last_cell(const report::Table& table, std::size_t row) {
  return table.rows.at(row).back();
}

TEST(MaxStiffnessSection, SaysCalibratedOnlyOfWhatWasFitted) {
  const report::Section fitted = max_stiffness_section({made_up_study(as_in_the_paper, true)});
  EXPECT_CONTAINS(paragraphs_of(fitted), "\"Calibrated\" means");
  EXPECT_EQ(last_cell(fitted.tables[0], 0), "calibrated");
  EXPECT_EQ(last_cell(fitted.tables[0], 1), "predicted");
  EXPECT_EQ(last_cell(fitted.tables[0], 4), "calibrated");
  EXPECT_EQ(last_cell(fitted.tables[0], 5), "predicted");
  const report::Section other = max_stiffness_section({made_up_study(as_in_the_paper, false)});
  EXPECT_LACKS(paragraphs_of(other), "alibrated");
  EXPECT_CONTAINS(paragraphs_of(other), "Everything is predicted");
  for (std::size_t row = 0; row < 8; ++row) EXPECT_EQ(last_cell(other.tables[0], row), "predicted") << row;
  const report::Section both = max_stiffness_section(
      {made_up_study(as_in_the_paper, true), made_up_study(as_in_the_paper, false, 0.0)});
  EXPECT_EQ(last_cell(both.tables[0], 0), "calibrated / predicted");
  for (const report::Table& table : both.tables) EXPECT_NO_THROW(report::require_rectangular(table));
}

TEST(MaxStiffnessSection, SaysWhatOfTheFitIsNoTest) {
  const std::string fitted = paragraphs_of(max_stiffness_section({made_up_study(as_in_the_paper, true)}));
  EXPECT_CONTAINS(fitted, "is implied by the fit");
  EXPECT_CONTAINS(fitted, "The only mean that tests the model is the adaptive wall's");
  EXPECT_LACKS(paragraphs_of(max_stiffness_section({made_up_study(as_in_the_paper, false)})), "implied");
}

TEST(MaxStiffnessSection, SaysWhereTheSearchBeginsAndWhy) {
  MaxStiffnessStudy study = made_up_study(as_in_the_paper, false);
  study.conditions[0].subjects[1].stiffness = 2900.0;
  EXPECT_CONTAINS(paragraphs_of(max_stiffness_section({study})),
                  "begins at 1 N/mm; the paper's at 3, and at 5 for the adaptive wall. Of 2 people 1 have no "
                  "stable plain wall there");
  study.steps.first = 3000.0;
  study.steps.first_adaptive = 5000.0;
  study.steps.goes_down = true;
  EXPECT_CONTAINS(paragraphs_of(max_stiffness_section({study})),
                  "begins at 3 N/mm (5 N/mm for the adaptive wall) and goes down where that is unstable");
}

TEST(MaxStiffnessSection, SaysIntendedAndActualSpeedAndWhatIsChanged) {
  MaxStiffnessStudy study = made_up_study(as_in_the_paper, false);
  study.run_up = 0.02;
  study.contact_speeds = {{0.1, 0.098}, {1.0, 0.67}};
  study.changes = TouchChanges({"wall.damping=8"}, Touching::set_of_people);
  const std::string words = paragraphs_of(max_stiffness_section({study}));
  EXPECT_CONTAINS(words, "a run-up of 20 mm the handle meets the wall at 0.098, 0.67 m/s where 0.1, 1 m/s");
  EXPECT_CONTAINS(words, "Changed for every touch: wall.damping=8. Nothing was fitted again.");
}

TEST(MaxStiffnessSection, ComparesTheAdaptiveWallAsItIs) {
  const auto words = [](double adaptive, double two) {
    std::vector<double> means = as_in_the_paper;
    means[4] = two;
    means[5] = adaptive;
    return paragraphs_of(max_stiffness_section({made_up_study(means, false)}));
  };
  EXPECT_CONTAINS(words(8100, 8410), "agrees. It is below a constant 2 N (8.41)");
  EXPECT_CONTAINS(words(7000, 6500),
                  "7.00 N/mm in its best mode; the paper's is 8.02, ours does not reach it");
  EXPECT_CONTAINS(words(7000, 6500), "not below a constant 2 N (6.50)");
  EXPECT_CONTAINS(words(9000, 8410), "goes beyond it");
}

TEST(MaxStiffnessSection, MarksMeansThatHoldBounds) {
  MaxStiffnessStudy study = made_up_study(as_in_the_paper, false);
  study.conditions[0].subjects[1].stiffness = 0.0;
  study.conditions[4].subjects[0].beyond_last = true;
  const report::Section section = max_stiffness_section({study});
  EXPECT_CONTAINS(section.tables[0].rows[0][2], "<1.79");
  EXPECT_CONTAINS(section.tables[0].rows[4][2], ">8.41");
  EXPECT_EQ(section.tables[0].rows[1][2].substr(0, 4), "4.00");
  EXPECT_CONTAINS(paragraphs_of(section), "F_MC = 0 N, force clipped at 3.3 N: 1 of 2");
  EXPECT_CONTAINS(paragraphs_of(section), "F_MC = 2 N, force clipped at 3.3 N: 1 of 2");
  EXPECT_LACKS(paragraphs_of(max_stiffness_section({made_up_study(as_in_the_paper, false)})), "of 2");
}

TEST(AsCalibrated, AsksForTheTargetsOnlyWhereTheyWereFitted) {
  EXPECT_TRUE(as_calibrated(made_up_study(as_in_the_paper, true)));
  const std::vector<double> lower{2000, 2100, 2200, 2300, 2400, 1, 1, 1};
  EXPECT_FALSE(as_calibrated(made_up_study(lower, true)));
  EXPECT_TRUE(as_calibrated(made_up_study(lower, false)));
  // Within 100 and 150 N/m.
  EXPECT_TRUE(as_calibrated(made_up_study({3680, 4000, 5000, 7000, 8560}, true)));
  EXPECT_FALSE(as_calibrated(made_up_study({3681, 4000, 5000, 7000, 8410}, true)));
  EXPECT_FALSE(as_calibrated(made_up_study({3580, 4000, 5000, 7000, 8561}, true)));
}

TEST(AsCalibrated, AsksForRisingStiffnessAlways) {
  const std::vector<double> dip{3580, 5000, 5000, 7000, 8410};
  EXPECT_FALSE(as_calibrated(made_up_study(dip, true)));
  EXPECT_FALSE(as_calibrated(made_up_study(dip, false)));
}

TEST(CalibrationSection, SaysWhetherTheTargetsWereMetAndWhereTheOtherChoicesAre) {
  OperatorCalibration fit;
  fit.plain = 3580.0;
  fit.magnetic = 5000.0;
  fit.plain_met = true;
  const report::Section section = calibration_section({fit});
  EXPECT_EQ(last_cell(section.tables[0], 0), "no");
  EXPECT_CONTAINS(paragraphs_of(section), "other choices meet 3.58 N/mm too");
  fit.magnetic_met = true;
  EXPECT_EQ(last_cell(calibration_section({fit}).tables[0], 0), "yes");
}

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

}  // namespace kmax::experiment::max_stiffness_report_test
