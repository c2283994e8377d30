#include "host_tools/experiment/resolution/resolution_report.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::resolution_report_test {
namespace {

ResolutionStudy study_of(const ResolutionSettings& settings) {
  return study_resolution(settings, weak_hand, resolution_hands(), std::vector<simulation::OperatorModel>(1));
}

ResolutionSettings few() {
  ResolutionSettings settings;
  settings.speeds = {0.05, 0.2};
  settings.touches = 1;
  return settings;
}

std::string all_words(const ResolutionStudy& study) {
  std::string all;
  for (const std::string& words : resolution_words(study)) all += words + "\n";
  return all;
}

TEST(ResolutionReport, SaysWhatHoldsAndWhatDoesNot) {
  const ResolutionStudy study = study_of(few());
  const std::string all = all_words(study);
  EXPECT_CONTAINS(all, "1 person, 1 touch with each push");
  EXPECT_EQ(all.find("Not tested"), std::string::npos) << all;
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
  const ResolutionStudy study = study_of(few());
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
  EXPECT_CONTAINS(resolution_words(study)[1], "the paper's claims are not all tested");
  EXPECT_CONTAINS(all_words(study), "for want of a touch there: 0.1 mm below 0.1 m/s, 0.1 mm above 0.1 m/s.");
  study.runs[0].cells[0].unstable = study.runs[0].cells[0].people_unstable = 0;
  EXPECT_CONTAINS(resolution_words(study)[1], "not met");
}

// With one speed only half of the second claim can be seen, and no other setting shows more of it.
TEST(ResolutionReport, WhatNoTouchTestedIsNeitherYesNorNo) {
  for (const double speed : {0.05, 0.2}) {
    ResolutionSettings settings = few();
    settings.speeds = {speed};
    const bool slow = speed < paper::vibration_onset_speed;
    const ResolutionStudy study = study_of(settings);
    const report::Table claims = resolution_claims_table(study), changed = resolution_variations_table(study);
    const std::size_t untested = slow ? 3 : 2, tested = slow ? 2 : 3;
    for (std::size_t run = 0; run < study.runs.size(); ++run) {
      EXPECT_EQ(claims.rows[run][untested], "not tested") << speed << " " << run;
      EXPECT_NE(claims.rows[run][tested], "not tested") << speed << " " << run;
    }
    for (const std::vector<std::string>& row : changed.rows) {
      EXPECT_EQ(row[untested], "not tested") << row[0];
      EXPECT_NE(row[4], "yes") << row[0];
    }
    const std::string all = all_words(study);
    EXPECT_CONTAINS(all, "the two claims were not both tested");
    EXPECT_CONTAINS(all, slow ? "for want of a touch there: 0.1 mm above 0.1 m/s."
                              : "for want of a touch there: 0.1 mm below 0.1 m/s.");
    EXPECT_EQ(all.find("both claims appear in"), std::string::npos) << all;
  }
}

}  // namespace
}  // namespace kmax::experiment::resolution_report_test
