#include <fcntl.h>
#include <unistd.h>

#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::contact_command_test {

using ContactCommand = SimulatedCommandLine;

TEST_F(ContactCommand, ContactIsADocumentWithAConditionForEachWall) {
  // Which of the two is a matter of the sampling instants of single touches.
  const int code = kmax({"experiment", "contact", "--trials", "1", "--hold", "1s", "--rate", "0.5kHz",
                         "--expect-paper", "--out", in("results"), "--json"});
  ASSERT_TRUE(code == base::done || code == base::verdict_is_no) << said;
  EXPECT_EQ(keys(),
            (std::vector<std::string>{"stiffness_n_per_m", "haptic_rate_hz", "hold_time_s", "threshold_m",
                                      "changed", "velocity_estimator", "conditions", "files"}));
  const Json conditions = document()["conditions"];
  ASSERT_EQ(conditions.size(), 6u);
  for (const Json& condition : conditions) {
    EXPECT_EQ(condition["trials"], 1);
    EXPECT_EQ(condition["lost_records"], 0);
    EXPECT_EQ(condition["unstable_trials"], condition["verdict"] == "unstable" ? 1 : 0);
    EXPECT_EQ(condition["agrees"], condition["verdict"] == condition["paper_verdict"]);
  }
  const bool all_agree = std::all_of(conditions.begin(), conditions.end(),
                                     [](const Json& c) { return c["agrees"].get<bool>(); });
  EXPECT_EQ(code, all_agree ? base::done : base::verdict_is_no);
  ASSERT_EQ(document()["files"].size(), 14u);
  const Json files = document()["files"];
  for (const Json& file : files) EXPECT_TRUE(std::filesystem::exists(file.get<std::string>()));
  const std::string page = folder.read("results/contact.html");
  for (const char* part : {"alt=\"F_MC = 0 N: position", "src=\"contact_f_mc_0_n.svg\"", "predicted"})
    EXPECT_CONTAINS(page, part);
}

TEST_F(ContactCommand, BadOptionsAreWrongUsage) {
  for (const std::vector<std::string>& bad : std::vector<std::vector<std::string>>{{"--stiffness", "-1"},
                                                                                   {"--stiffness", "nan"},
                                                                                   {"--rate", "333"},
                                                                                   {"--rate", "0"},
                                                                                   {"--hold", "0.5"},
                                                                                   {"--threshold", "0"},
                                                                                   {"--hold", "nan"},
                                                                                   {"--hold", "inf"},
                                                                                   {"--threshold", "nan"},
                                                                                   {"--patience", "nan"},
                                                                                   {"--trials", "0"},
                                                                                   {"--trials", "1.5"},
                                                                                   {"--format", "gif"},
                                                                                   {"--force-limit", "0"},
                                                                                   {"--force-limit", "nan"},
                                                                                   {"--abort-amplitude", "0"},
                                                                                   {"--axis", "2"},
                                                                                   {"--device", "tcp:x"}}) {
    std::vector<std::string> arguments = {"experiment", "contact"};
    arguments.insert(arguments.end(), bad.begin(), bad.end());
    EXPECT_EQ(kmax(arguments), base::wrong_usage) << bad[0] << " " << bad[1] << ": " << said;
  }
}

TEST_F(ContactCommand, ADifferenceToThePaperIsAResultLikeAnyOther) {
  // By a threshold that no touch keeps to, the paper's stable conditions come out unstable.
  const std::vector<std::string> arguments{"experiment", "contact", "--trials",    "1",
                                           "--hold",     "1",       "--threshold", "1e-9"};
  EXPECT_EQ(kmax(arguments), base::done) << said;
  EXPECT_CONTAINS(output, "agrees");
  EXPECT_CONTAINS(output, " no\n");
  EXPECT_EQ(output.find("trials counts"), std::string::npos) << "one touch has no worst";
}

TEST_F(ContactCommand, AnotherWallThanThePapersIsNotJudgedAgainstItsVerdicts) {
  const std::vector<std::string> arguments{"experiment", "contact", "--trials", "1",           "--hold",
                                           "1",          "--rate",  "800",      "--stiffness", "4700"};
  EXPECT_EQ(kmax(arguments), base::done) << said;
  EXPECT_CONTAINS(output, "verdicts are of a wall of 5.5 N/mm at 500 Hz");
  EXPECT_CONTAINS(output, "not compared\n");
  auto with = [&](const char* more) {
    auto all = arguments;
    all.emplace_back(more);
    return all;
  };
  EXPECT_EQ(kmax(with("--json")), base::done) << said;
  for (const Json& condition : document()["conditions"]) EXPECT_TRUE(condition["agrees"].is_null());
  EXPECT_EQ(kmax(with("--expect-paper")), base::wrong_usage);
  EXPECT_CONTAINS(said, "leave --stiffness, --rate and");
}

TEST_F(ContactCommand, EveryTouchIsAsItIsSetToBe) {
  const auto plain_with = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"experiment", "contact", "--trials", "1", "--hold", "1", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(kmax(arguments), base::done) << said;
    return document();
  };
  const Json usual = plain_with({});
  EXPECT_TRUE(usual["changed"].empty());
  const Json changed = plain_with({"--set", "motion.approach_speed=0.05", "--set", "haptic.rate=1kHz",
                                   "--set", "wall.damping=5", "--set", "velocity.estimator=difference"});
  EXPECT_EQ(changed["haptic_rate_hz"], 1000);
  EXPECT_EQ(changed["velocity_estimator"], "difference");
  EXPECT_EQ(changed["changed"].size(), 4u);
  EXPECT_TRUE(changed["conditions"][0]["agrees"].is_null());
  EXPECT_EQ(usual["conditions"][0]["verdict"], "unstable");
  EXPECT_EQ(changed["conditions"][0]["verdict"], "stable");
  EXPECT_NEAR(usual["conditions"][0]["contact_speed_m_per_s"].get<double>(), 0.2, 0.06);
  EXPECT_NEAR(changed["conditions"][0]["contact_speed_m_per_s"].get<double>(), 0.05, 0.02);
  EXPECT_EQ(kmax({"experiment", "contact", "--set", "wall.stiffness=3"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "--stiffness");
}

TEST_F(ContactCommand, AFolderThatCannotBeMadeIsAFailure) {
  folder.write("file", "");
  EXPECT_EQ(kmax({"experiment", "contact", "--trials", "1", "--hold", "1", "--out", in("file/x"), "--json"}),
            base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "file/x");
}

/// A board that is reached under the address of a real one, by somebody whose standard input has ended.
class ContactOnADevice : public ContactCommand {
 protected:
  ContactOnADevice() : input_(dup(STDIN_FILENO)) {
    const int nothing = open("/dev/null", O_RDONLY);
    dup2(nothing, STDIN_FILENO);
    close(nothing);
  }
  ~ContactOnADevice() override {
    dup2(input_, STDIN_FILENO);
    close(input_);
  }
  int on_device(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"experiment", "contact", "--device", "serial:/dev/none",
                                          "--trials",   "1",       "--hold",   "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return kmax(std::move(arguments),
                [](const std::string&, const device::Notice&) { return device::make_sim_link(); });
  }

 private:
  int input_;
};

TEST_F(ContactOnADevice, SomebodyIsAskedBeforeThereIsForce) {
  EXPECT_EQ(on_device({}), base::failed);
  EXPECT_CONTAINS(said, "F_MC = 0 N: take the handle out of the wall");
  EXPECT_CONTAINS(said, "--no-prompt");
  EXPECT_EQ(said.find("holding"), std::string::npos);
}

TEST_F(ContactOnADevice, WithoutAPromptNobodyIsAsked) {
  EXPECT_EQ(on_device({"--no-prompt", "--json"}), base::done) << said;
  EXPECT_EQ(said.find("take the handle out of the wall and be ready"), std::string::npos) << said;
  EXPECT_EQ(document()["conditions"].size(), 6u);
}

TEST_F(ContactCommand, TheSecondAxisOfASimulatedDeviceHasNobodyToTouchIt) {
  EXPECT_EQ(kmax({"experiment", "contact", "--axis", "1", "--trials", "1", "--json"}), base::failed)
      << output;
}

}  // namespace kmax::cli::contact_command_test
