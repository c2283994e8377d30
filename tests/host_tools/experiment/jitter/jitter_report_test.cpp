#include "host_tools/experiment/jitter/jitter_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment {
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
  const JitterStudy study = study_jitter(few(), std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Sizes are not reproduced");
  EXPECT_CONTAINS(words, "not clipped");
  EXPECT_CONTAINS(words, "15 ms");
  ASSERT_EQ(study.variations.size(), 2u);
  EXPECT_FALSE(study.variations[0].verdict.amplitude_falls());
  for (const auto& table : {jitter_table(study), jitter_claims_table(study), jitter_variations_table(study)})
    EXPECT_NO_THROW(report::require_rectangular(table));
  EXPECT_EQ(jitter_table(study).rows.size(), paper::table_1.size());
  EXPECT_EQ(jitter_claims_table(study).rows.size(), 6u);
}

TEST(JitterReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const JitterStudy study = study_jitter(few(), std::vector<simulation::OperatorModel>(1));
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
  EXPECT_CONTAINS(all_words(study), "not shown");
  EXPECT_EQ(jitter_table(study).rows[0][3], "-");
  EXPECT_EQ(write_jitter(study, folder / "new", ".svg").size(), 4u);
}

}  // namespace
}  // namespace kmax::experiment
