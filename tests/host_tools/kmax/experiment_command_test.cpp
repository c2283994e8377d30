#include <filesystem>

#include "host_tools/kmax/experiment_study.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::experiment_command_test {
namespace {
using Experiment = SimulatedCommandLine;

TEST_F(Experiment, WithoutANameOrWithAnUnknownOneIsWrongUsage) {
  EXPECT_EQ(kmax({"experiment"}), wrong_usage);
  EXPECT_EQ(kmax({"experiment", "nothing"}), wrong_usage);
}

// The help that a message points to is the one that has the option.
TEST_F(Experiment, AWrongValuePointsToTheHelpOfTheExperimentThatItWasGivenTo) {
  expect_error({"experiment", "jitter", "--stiffness", "0"}, wrong_usage,
               "experiment jitter: --stiffness: Value 0 not in range");
  expect_error({"experiment", "jitter", "--stiffness", "0"}, wrong_usage,
               "'kmax experiment jitter --help' explains it");
  expect_error({"--device", "sim", "experiment", "resolution", "--nothing"}, wrong_usage,
               "'kmax experiment resolution --help' explains it");
  expect_error({"experiment", "--nothing", "jitter"}, wrong_usage, "'kmax experiment");
  expect_error({"experiment"}, wrong_usage, "'kmax experiment --help' explains it");
  expect_error({"wall", "--position", "here"}, wrong_usage, "'kmax wall --help' explains it");
}

TEST_F(Experiment, HelpNamesEveryExperimentOfThePapers) {
  EXPECT_EQ(kmax({"experiment", "--help"}), done);
  for (const char* name : {"max-stiffness", "contact", "jitter", "deviation", "resolution"})
    EXPECT_CONTAINS(output, name);
}

// An option of the other kind of device would be believed to be at work.
TEST_F(Experiment, OptionsOfTheOtherKindOfDeviceAreRefused) {
  for (const char* name : {"jitter", "deviation", "resolution"}) {
    for (const std::vector<std::string>& of_device :
         std::vector<std::vector<std::string>>{{"--no-prompt"},
                                               {"--patience", "5"},
                                               {"--force-limit", "2"},
                                               {"--axis", "1"},
                                               {"--axis", "0"},
                                               {"--resume", "--out", in("out")}}) {
      std::vector<std::string> arguments = {"experiment", name};
      arguments.insert(arguments.end(), of_device.begin(), of_device.end());
      expect_error(arguments, wrong_usage, of_device[0] + " is for a device; name one with --device");
    }
    expect_error({"experiment", name, "--device", "serial:/dev/none", "--subjects", "clipped"}, wrong_usage,
                 "--subjects is for simulated people; leave --device out");
    expect_error({"experiment", name, "--device", "serial:/dev/none", "--clip", "0"}, wrong_usage,
                 "--clip is for simulated people");
  }
}

TEST_F(Experiment, AJournalIsKeptWhereThereIsAFolderAndResumedFromThereOnly) {
  std::ostringstream out, messages;
  Context context(out, messages, {});
  const Json settings = {{"experiment", "x"}};
  EXPECT_EQ(open_touch_journal(context, "", "x", settings, false), nullptr);
  EXPECT_THROW(open_touch_journal(context, "", "x", settings, true), UsageError);
  std::filesystem::create_directory(folder / "out");
  open_touch_journal(context, in("out"), "x", settings, false)->add("a", 1);
  EXPECT_EQ(messages.str(), "");
  EXPECT_EQ(open_touch_journal(context, in("out"), "x", settings, true)->resumed(), 1u);
  EXPECT_CONTAINS(messages.str(), "done already: 1 touch");
  EXPECT_TRUE(std::filesystem::exists(folder / "out/x.journal"));
}

}  // namespace
}  // namespace kmax::cli::experiment_command_test
