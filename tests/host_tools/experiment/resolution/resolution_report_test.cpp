#include "host_tools/experiment/resolution/resolution_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment {
namespace {

ResolutionSettings few() {
  ResolutionSettings settings;
  settings.speeds = {0.05, 0.2};
  settings.touches = 1;
  return settings;
}

TEST(ResolutionReport, SaysWhatHoldsAndWhatDoesNot) {
  const ResolutionStudy study = study_resolution(few(), std::vector<simulation::OperatorModel>(1));
  std::string all;
  for (const std::string& words : resolution_words(study)) all += words + "\n";
  EXPECT_CONTAINS(all, "With a full grip and no delay nothing vibrates");
  EXPECT_CONTAINS(all, "both claims appear");
  EXPECT_CONTAINS(all, "calibrated, not predicted");
  EXPECT_CONTAINS(all, "not the work of the resolution");
  EXPECT_NO_THROW(report::require_rectangular(resolution_table(study)));
  EXPECT_NO_THROW(report::require_rectangular(resolution_claims_table(study)));
  EXPECT_EQ(resolution_table(study).rows.size(), 6u);
  EXPECT_GT(resolution_variations_table(study).rows.size(), 10u);
}

TEST(ResolutionReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const ResolutionStudy study = study_resolution(few(), std::vector<simulation::OperatorModel>(1));
  const auto files = write_resolution(study, folder / "new", ".svg");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

TEST(ResolutionReport, ADevicesTouchesNeedNoSimulation) {
  const host_tools_test::TemporaryFolder folder;
  ResolutionStudy study;
  study.origin = report::Origin::measured;
  ResolutionCell cell;
  cell.resolution = 0.4e-3;
  cell.touches = cell.people = cell.unstable = cell.people_unstable = 1;
  cell.speed = 0.1;
  cell.peak_to_peak = 1e-3;
  study.runs = {{{}, {cell}}};
  EXPECT_EQ(resolution_table(study).rows.size(), 1u);
  EXPECT_EQ(write_resolution(study, folder / "new", ".svg").size(), 5u);
  EXPECT_CONTAINS(resolution_words(study)[1], "not met");
}

}  // namespace
}  // namespace kmax::experiment
