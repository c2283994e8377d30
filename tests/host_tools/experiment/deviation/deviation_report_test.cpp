#include "host_tools/experiment/deviation/deviation_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::deviation_report_test {
namespace {
using host_tools_test::thrown_message;

DeviationSettings few() {
  DeviationSettings settings;
  settings.protocol.pulses = 1;
  return settings;
}

std::string all_words(const DeviationStudy& study) {
  std::string all;
  for (const std::string& words : deviation_words(study)) all += words + "\n";
  return all;
}

TEST(DeviationReport, SaysWhatHoldsAndWhatTheTableDoesNotTell) {
  const DeviationStudy study =
      study_deviation(few(), deviation_hands(), std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Here it falls at every F_I");
  EXPECT_CONTAINS(words, "With a hand that does not stiffen it does not fall");
  EXPECT_CONTAINS(words, "hardly identifies a stiffness gain");
  EXPECT_CONTAINS(words, "Sizes are not reproduced");
  for (const auto& table :
       {deviation_table(study), deviation_claims_table(study), deviation_fit_table(study)})
    EXPECT_NO_THROW(report::require_rectangular(table));
  EXPECT_EQ(deviation_table(study).rows.size(), paper::table_2.size());
  EXPECT_EQ(deviation_claims_table(study).rows.size(), 9u);
  EXPECT_EQ(deviation_fit_table(study).rows.size(), 4u);
}

TEST(DeviationReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const DeviationStudy study =
      study_deviation(few(), deviation_hands(), std::vector<simulation::OperatorModel>(1));
  const auto files = write_deviation(study, folder / "new", ".svg");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

TEST(DeviationReport, APageOfADeviceWithoutResults) {
  const host_tools_test::TemporaryFolder folder;
  DeviationStudy study;
  study.origin = report::Origin::measured;
  study.results = {mean_deviation(*paper::deviation(0, 5), {}), mean_deviation(*paper::deviation(3, 5), {})};
  study.verdict = judge_deviation(study.results);
  study.fits = fit_table_2();
  EXPECT_NO_THROW(report::require_rectangular(deviation_table(study)));
  EXPECT_EQ(write_deviation(study, folder / "new", ".svg").size(), 5u);
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "this is not shown");
  EXPECT_EQ(words.find("does not fall"), std::string::npos) << words;
  EXPECT_EQ(words.find("the work of F_I"), std::string::npos) << "of numbers that nobody has";
  const report::Table claims = deviation_claims_table(study);
  ASSERT_EQ(claims.rows.size(), 6u);
  using Row = std::vector<std::string>;
  EXPECT_EQ(claims.rows[0], (Row{"measured", "3", "-", "-", "-", "-", "not shown"}));
  EXPECT_EQ(claims.rows[3], (Row{"paper", "3", "1.40", "0.68", "0.49", "-", "yes"}));
  EXPECT_EQ(claims.rows[5], (Row{"paper", "7", "16.60", "7.80", "0.47", "-", "yes"}));
}

// The numbers of another pair of forces in its place would be taken for those without F_B.
TEST(DeviationReport, WithoutTheTouchWithoutABackgroundForceNothingIsShown) {
  DeviationStudy study;
  study.origin = report::Origin::measured;
  for (const paper::DeviationCell& cell : paper::table_2) {
    DeviationResult result = mean_deviation(cell, {});
    result.deviation = cell.deviation;
    result.touches = cell.background > 0.0 ? 1 : 0;
    study.results.push_back(result);
  }
  study.verdict = judge_deviation(study.results);
  using Row = std::vector<std::string>;
  EXPECT_EQ(deviation_claims_table(study).rows[1],
            (Row{"measured", "5", "-", "2.40", "-", "-1.00", "not shown"}));
  EXPECT_CONTAINS(all_words(study), "this is not shown");
}

TEST(DeviationReport, TheStiffeningIsTheCauseOnlyIfNothingElseIs) {
  const auto words_when = [](bool falls, bool falls_without) {
    const auto results = [](bool fall) {
      std::vector<DeviationResult> cells;
      for (const paper::DeviationCell& cell : paper::table_2) {
        DeviationResult result = mean_deviation(cell, {});
        result.touches = 1;
        const double share = fall ? 1.0 / (1.0 + cell.background) : 1.0 + cell.background;
        result.deviation = 1e-3 * cell.interference * share;
        cells.push_back(result);
      }
      return cells;
    };
    DeviationStudy study;
    study.results = results(falls);
    study.verdict = judge_deviation(study.results);
    study.without_stiffening = results(falls_without);
    study.verdict_without_stiffening = judge_deviation(study.without_stiffening);
    return all_words(study);
  };
  const char* cause = "the stiffening and nothing else";
  EXPECT_CONTAINS(words_when(true, false), cause);
  for (const auto& [falls, without] :
       {std::pair{true, true}, std::pair{false, true}, std::pair{false, false}})
    EXPECT_EQ(words_when(falls, without).find(cause), std::string::npos) << falls << without;
  EXPECT_CONTAINS(words_when(true, true), "something else than the stiffening makes the trend");
  EXPECT_CONTAINS(words_when(false, false), "no trend to explain");
}

TEST(DeviationReport, APushThatLosesTheWallIsRefused) {
  SimulatedHands hands = deviation_hands();
  hands.push = 3.0;
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>(
                      [&] { study_deviation({}, hands, std::vector<simulation::OperatorModel>(1)); }),
                  "push harder than every F_B");
}

// People who do not stiffen are their own comparison.
TEST(DeviationReport, PeopleWhoDoNotStiffenShowNoWorkOfStiffening) {
  std::vector<simulation::OperatorModel> people(1);
  people[0].activation_gain = 0.0;
  const std::string words = all_words(study_deviation(few(), deviation_hands(), people));
  EXPECT_EQ(words.find("nothing else"), std::string::npos) << words;
}

}  // namespace
}  // namespace kmax::experiment::deviation_report_test
