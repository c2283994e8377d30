#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::max_stiffness_sections_test {
namespace {

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
  EXPECT_CONTAINS(paragraphs_of(section), "--study assumptions");
  fit.magnetic_met = true;
  EXPECT_EQ(last_cell(calibration_section({fit}).tables[0], 0), "yes");
}

TEST(CauseSection, MarksMeansThatHoldBoundsAndSaysForHowMany) {
  ClippedCauses found;
  found.set.subjects = draw_subjects(12, 1);
  for (const CauseCondition& condition : cause_conditions(2.0)) found.causes.push_back({condition, 2500.0});
  found.causes[1].mean = 150.0;
  found.causes[1].ends.at_zero = 5;
  found.causes[4].ends.beyond_last = 2;
  found.lengths = {{0.5e-3, 8000.0, 120.0, {7, 0}}, {1e-3, 4000.0, 900.0, {}}};
  const report::Section section = cause_section({found});
  EXPECT_EQ(section.tables[0].rows[0][2], "2.50");
  EXPECT_EQ(section.tables[0].rows[1][2], "<0.15");
  EXPECT_EQ(section.tables[0].rows[4][2], ">2.50");
  EXPECT_EQ(section.tables[0].rows[4][1], "k1 and b1 grown");
  EXPECT_EQ(section.tables[1].rows[0][2], "<0.12");
  EXPECT_EQ(section.tables[1].rows[1][2], "0.90");
  const std::string words = paragraphs_of(section);
  EXPECT_CONTAINS(words, "begins at 100 N/m");
  EXPECT_CONTAINS(words, "field, hand unchanged, force clipped at 3.3 N: 5 of 12");
  EXPECT_CONTAINS(words, "x_0 = 0.5 mm, force clipped at 3.3 N: 7 of 12");
  EXPECT_CONTAINS(words, "grip stiffer, no field, force clipped at 3.3 N: 2 of 12");
}

TEST(VariationSection, AMissedFitIsSaidAndNothingIsRobustWithIt) {
  VariationResult good;
  good.variation.refit = true;
  good.means = as_in_the_paper;
  VariationResult plain = good, magnetic = good, both = good, as_fitted = good;
  plain.plain_met = both.plain_met = false;
  magnetic.magnetic_met = both.magnetic_met = false;
  as_fitted.variation.refit = false;
  const report::Section clean = variation_section("x", {good, as_fitted});
  EXPECT_EQ(clean.tables[0].rows[0][3], "met");
  EXPECT_EQ(clean.tables[0].rows[1][3], "-");
  EXPECT_TRUE(clean.paragraphs[0].starts_with("Robust: ")) << clean.paragraphs[0];
  EXPECT_CONTAINS(clean.paragraphs[0], "(2 of 2)");
  const report::Section missed = variation_section("x", {good, plain, magnetic, both});
  EXPECT_EQ(missed.tables[0].rows[1][3], "missed: plain");
  EXPECT_EQ(missed.tables[0].rows[2][3], "missed: 2 N");
  EXPECT_EQ(missed.tables[0].rows[3][3], "missed: both");
  for (const std::string& words : missed.paragraphs) EXPECT_LACKS(words, "Robust: ");
  EXPECT_TRUE(missed.paragraphs[0].starts_with("Not robust: ")) << missed.paragraphs[0];
  EXPECT_TRUE(variation_section("x", {good, good, good, both}).paragraphs[0].starts_with("Mostly: "));
  EXPECT_CONTAINS(missed.paragraphs[0], "(1 of 1; 3 whose fit missed its targets left out)");
  EXPECT_TRUE(variation_section("x", {both}).paragraphs[0].starts_with("Not judged: "));
  EXPECT_NO_THROW(report::require_rectangular(missed.tables[0]));
}

TEST(VariationSection, MarksMeansThatHoldBounds) {
  VariationResult one;
  one.variation.name = "pushes of 1 N";
  one.variation.set.subjects = draw_subjects(12, 1);
  one.means = as_in_the_paper;
  one.ends.resize(8);
  one.ends[1] = {3, 0};
  one.ends[2] = {0, 2};
  const report::Section section = variation_section("x", {one});
  EXPECT_EQ(section.tables[0].rows[0][6], "3.58");
  EXPECT_EQ(section.tables[0].rows[0][7], "<4.00");
  EXPECT_EQ(section.tables[0].rows[0][8], ">5.00");
  EXPECT_CONTAINS(paragraphs_of(section), "pushes of 1 N, F_MC = 0.5 N: 3 of 12");
  EXPECT_CONTAINS(paragraphs_of(section), "pushes of 1 N, F_MC = 1 N: 2 of 12");
}

TEST(VariationSection, TheWordsFollowTheShare) {
  VariationResult rises, falls;
  rises.means = as_in_the_paper;
  falls.means = {5000, 4000, 3, 4, 5, 1, 1, 1};
  const auto first_word = [&](std::size_t rising, std::size_t falling) {
    std::vector<VariationResult> results(rising, rises);
    results.insert(results.end(), falling, falls);
    const std::string words = variation_section("x", results).paragraphs[0];
    return words.substr(0, words.find(':'));
  };
  EXPECT_EQ(first_word(3, 0), "Robust");
  EXPECT_EQ(first_word(3, 1), "Mostly");
  EXPECT_EQ(first_word(2, 1), "Not robust");
  EXPECT_EQ(first_word(0, 2), "Never");
}

}  // namespace
}  // namespace kmax::experiment::max_stiffness_sections_test
