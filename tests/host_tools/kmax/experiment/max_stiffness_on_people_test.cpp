// kmax experiment max-stiffness on simulated people: what is called calibrated.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <sstream>

#include "host_tools/base/exit_code.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/kmax/experiment/max_stiffness_options.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::max_stiffness_on_people_test {

class MaxStiffnessOnPeople : public testing::Test {
 protected:
  MaxStiffnessOnPeople() { options.conditions = {"0"}; }

  int measure() {
    std::ostringstream out, messages;
    Context context(out, messages, [](const std::string&, const device::Notice&) {
      return std::unique_ptr<device::Link>();
    });
    const base::Interruption interruption;
    const int code = run_model_max_stiffness(context, options, interruption);
    output = out.str();
    return code;
  }
  // The column of the table, and what the page says of it.
  bool says_calibrated() const { return output.find("alibrated") != std::string::npos; }
  std::string own_set(const std::string& begin, double friction) const {
    return folder
        .write("own.toml",
               begin + fmt::format("[device]\nfriction = {}\nforce_limit = 3.3\n[[subject]]\n", friction))
        .string();
  }

  host_tools_test::TemporaryFolder folder;
  MaxStiffnessOptions options;
  std::string output;
};

const char* const fitted_to_the_paper = "[fitted]\nplain = 3580.0\nmagnetic = 8410.0\nforce_limit = 3.3\n";

TEST_F(MaxStiffnessOnPeople, TheSuppliedSetsAreCalibrated) {
  EXPECT_EQ(measure(), base::done);
  EXPECT_CONTAINS(output, "\"Calibrated\" means");
  options.subjects = "unclipped";
  EXPECT_EQ(measure(), base::done);
  EXPECT_TRUE(says_calibrated()) << output;
}

TEST_F(MaxStiffnessOnPeople, OtherPeopleAreNot) {
  options.seed = 7;
  EXPECT_EQ(measure(), base::done);
  EXPECT_FALSE(says_calibrated()) << output;
  EXPECT_CONTAINS(output, "predicted");
}

TEST_F(MaxStiffnessOnPeople, AnotherForceLimitIsNot) {
  options.subjects = "clipped";
  options.clip = "off";
  EXPECT_EQ(measure(), base::done);
  EXPECT_FALSE(says_calibrated()) << output;
}

TEST_F(MaxStiffnessOnPeople, MoreTouchesThanTheFitHadAreNot) {
  options.phases = 2;
  EXPECT_EQ(measure(), base::done);
  EXPECT_FALSE(says_calibrated()) << output;
  EXPECT_CONTAINS(output, "30 touches at every stiffness");
  options.calibrate = true;
  options.files.folder = folder.path().string();
  EXPECT_CONTAINS(host_tools_test::thrown_message<UsageError>([&] { measure(); }), "--phases 2");
}

TEST_F(MaxStiffnessOnPeople, AHandWrittenSetIsNotAndNeedNotMeetThePaper) {
  options.subjects = own_set("", 0.5);
  EXPECT_EQ(measure(), base::done);
  EXPECT_FALSE(says_calibrated()) << output;
  // The same numbers in a set that says it was fitted have missed.
  options.subjects = own_set(fitted_to_the_paper, 0.5);
  EXPECT_EQ(measure(), base::done) << "a result, unless the paper's is expected";
  options.expect_paper = true;
  EXPECT_EQ(measure(), base::verdict_is_no);
  EXPECT_TRUE(says_calibrated()) << output;
}

TEST_F(MaxStiffnessOnPeople, ACalibrationSaysInItsSetWhatItWasFittedTo) {
  options.subjects = own_set("", 0.1);
  options.files.folder = (folder / "out").string();
  options.calibrate = true;
  measure();
  EXPECT_TRUE(says_calibrated()) << output;
  const auto set = experiment::load_subject_set(folder / "out" / "clipped.toml");
  ASSERT_TRUE(set.fitted);
  EXPECT_EQ(set.fitted->plain_target, 3580.0);
  EXPECT_EQ(set.fitted->magnetic_target, 8410.0);
  EXPECT_EQ(set.fitted->force_limit, 3.3);
}

TEST_F(MaxStiffnessOnPeople, WhatASetWasFittedToIsNoReasonToRefuseItsJournal) {
  options.files.folder = (folder / "out").string();
  options.subjects = own_set("", 0.1);
  measure();
  options.resume = true;
  options.subjects = own_set(fitted_to_the_paper, 0.1);
  EXPECT_NO_THROW(measure());
  options.subjects = own_set("", 0.2);
  EXPECT_THROW(measure(), std::exception);
}

}  // namespace kmax::cli::max_stiffness_on_people_test
