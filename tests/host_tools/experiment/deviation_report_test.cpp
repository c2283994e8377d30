#include "host_tools/experiment/deviation_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment {
namespace {

DeviationSettings few() {
  DeviationSettings settings;
  settings.protocol.pulses = 1;
  return settings;
}

TEST(DeviationReport, SaysWhatHoldsAndWhatTheTableDoesNotTell) {
  const DeviationStudy study = study_deviation(few(), std::vector<simulation::OperatorModel>(1));
  std::string words;
  for (const std::string& one : deviation_words(study)) words += one + "\n";
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
  const DeviationStudy study = study_deviation(few(), std::vector<simulation::OperatorModel>(1));
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
}

}  // namespace
}  // namespace kmax::experiment
