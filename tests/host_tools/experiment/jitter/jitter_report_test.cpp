#include "host_tools/experiment/jitter/jitter_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::jitter_report_test {
namespace {

JitterSettings few() {
  JitterSettings settings;
  settings.touches = 1;
  return settings;
}

std::string all_words(const JitterStudy& study) {
  std::string all;
  for (const std::string& words : jitter_words(study)) all += words + "\n";
  return all;
}

TEST(JitterReport, SaysWhatHoldsAndWhatIsNotReproduced) {
  const JitterStudy study = study_jitter(few(), jitter_hands(), std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Sizes are not reproduced");
  EXPECT_CONTAINS(words, "not clipped");
  EXPECT_CONTAINS(words, "15 ms");
  ASSERT_EQ(study.variations.size(), 2u);
  EXPECT_EQ(study.variations[0].verdict.amplitude_falls(), false);
  EXPECT_CONTAINS(words, "1 person, 1 touch each");
  EXPECT_CONTAINS(words,
                  "With a hand that does not stiffen Jit does not fall: in this model the trend is the");
  for (const auto& table : {jitter_table(study), jitter_claims_table(study), jitter_variations_table(study)})
    EXPECT_NO_THROW(report::require_rectangular(table));
  EXPECT_EQ(jitter_table(study).rows.size(), paper::table_1.size());
  EXPECT_EQ(jitter_claims_table(study).rows.size(), 6u);
}

TEST(JitterReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const JitterStudy study = study_jitter(few(), jitter_hands(), std::vector<simulation::OperatorModel>(1));
  const auto files = write_jitter(study, folder / "new", ".svg");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

// All that was aborted or never touched has no numbers, and a page all the same.
TEST(JitterReport, APageOfADeviceWithoutResults) {
  const host_tools_test::TemporaryFolder folder;
  JitterStudy study;
  study.origin = report::Origin::measured;
  study.results = {mean_jitter(*paper::jitter(0, 5), {}), mean_jitter(*paper::jitter(3, 5), {})};
  study.results[0].aborted = 1;
  study.verdict = judge_jitter(study.results);
  EXPECT_CONTAINS(all_words(study), "Jit: not shown");
  EXPECT_CONTAINS(all_words(study), "AT: not shown");
  EXPECT_EQ(all_words(study).find("the work of F_I"), std::string::npos) << "of numbers that nobody has";
  EXPECT_EQ(jitter_table(study).rows[0][3], "-");
  for (const std::vector<std::string>& row : jitter_claims_table(study).rows) {
    EXPECT_EQ(row[2], "-");
    EXPECT_EQ(row[3], "-");
    EXPECT_EQ(row.back(), "not shown");
  }
  EXPECT_EQ(write_jitter(study, folder / "new", ".svg").size(), 4u);
}

// A device that clips the force takes the trend away, and with it all that could be said of its cause.
TEST(JitterReport, WhereNothingFallsThereIsNoTrendWhoseCauseTheStiffeningIs) {
  SimulatedHands hands = jitter_hands();
  hands.device.force_limit = 1.0;
  const JitterStudy study = study_jitter(few(), hands, std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Jit: does not fall");
  EXPECT_CONTAINS(words, "no trend to explain");
  EXPECT_EQ(words.find("the trend is the stiffening"), std::string::npos) << words;
}

// A handle that was outside to the window's end has no adjustment time: neither one that falls nor one that
// does not.
TEST(JitterReport, TimesThatNobodyHasAreNotShownInEveryTable) {
  JitterStudy study;
  for (const paper::JitterCell& cell : paper::table_1) {
    JitterMeasure measure;
    measure.touched = true;
    measure.amplitude = cell.amplitude;
    measure.adjustment_time = cell.adjustment_time;
    study.results.push_back(mean_jitter(cell, {&measure, 1}));
  }
  study.verdict = judge_jitter(study.results);
  EXPECT_CONTAINS(all_words(study), "AT: not shown, since touches did not settle");
  const report::Table claims = jitter_claims_table(study);
  ASSERT_EQ(claims.rows.size(), 6u);
  for (std::size_t row = 0; row < 6; ++row)
    EXPECT_EQ(claims.rows[row].back(), row < 3 ? "yes" : "not shown") << row;
  EXPECT_EQ(jitter_variations_table(study).rows[0][1], "yes");
  EXPECT_EQ(jitter_variations_table(study).rows[0][2], "not shown");
}

TEST(JitterReport, APairThatNobodyTouchedHasNoNumberAmongTheCauses) {
  JitterStudy study;
  for (const paper::JitterCell& cell : paper::table_1) study.results.push_back(mean_jitter(cell, {}));
  study.verdict = judge_jitter(study.results);
  const std::vector<std::string> row = jitter_variations_table(study).rows[0];
  EXPECT_EQ(row[4], "- -> -");
  EXPECT_EQ(row[5], "- -> -");
}

}  // namespace
}  // namespace kmax::experiment::jitter_report_test
