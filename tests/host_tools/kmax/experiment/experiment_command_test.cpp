#include <filesystem>
#include <sstream>

#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::experiment_command_test {

struct Experiment : SimulatedCommandLine {
  /// Of all experiments, as the help lists them: two spaces, the name, what it does.
  std::vector<std::string> names() {
    EXPECT_EQ(kmax({"experiment", "--help"}), base::done);
    std::istringstream help(output.substr(output.find("Commands:")));
    std::vector<std::string> all;
    for (std::string line; std::getline(help, line);)
      if (line.size() > 2 && line.starts_with("  ") && line[2] != ' ' && line[2] != '-')
        all.push_back(line.substr(2, line.find(' ', 2) - 2));
    return all;
  }
};

TEST_F(Experiment, WithoutANameOrWithAnUnknownOneIsWrongUsage) {
  EXPECT_EQ(kmax({"experiment"}), base::wrong_usage);
  EXPECT_EQ(kmax({"experiment", "nothing"}), base::wrong_usage);
}

// The help that a message points to is the one that has the option.
TEST_F(Experiment, AWrongValuePointsToTheHelpOfTheExperimentThatItWasGivenTo) {
  expect_error({"experiment", "jitter", "--stiffness", "0"}, base::wrong_usage,
               "experiment jitter: --stiffness: 0 N/m not in range 1 .. 1e6 N/m");
  expect_error({"experiment", "jitter", "--stiffness", "0"}, base::wrong_usage,
               "'kmax experiment jitter --help' explains it");
  expect_error({"--device", "sim", "experiment", "resolution", "--nothing"}, base::wrong_usage,
               "'kmax experiment resolution --help' explains it");
  expect_error({"experiment", "--nothing", "jitter"}, base::wrong_usage, "'kmax experiment");
  expect_error({"experiment"}, base::wrong_usage, "'kmax experiment --help' explains it");
  expect_error({"wall", "--position", "here"}, base::wrong_usage, "'kmax wall --help' explains it");
}

TEST_F(Experiment, HelpNamesEveryExperimentOfThePapers) {
  EXPECT_GE(names().size(), 5u);
  for (const std::string& name : names()) {
    EXPECT_EQ(kmax({"experiment", name, "--help"}), base::done) << name;
    EXPECT_CONTAINS(output, "kmax experiment " + name + " ");
    EXPECT_CONTAINS(output, "--out");
  }
}

// An option of the other kind of device would be believed to be at work.
TEST_F(Experiment, OptionsOfTheOtherKindOfDeviceAreRefused) {
  for (const std::string& name : names()) {
    EXPECT_EQ(kmax({"experiment", name, "--help"}), base::done);
    if (output.find("--subjects") == std::string::npos) continue;  // one command for both kinds of device
    for (const std::vector<std::string>& of_device :
         std::vector<std::vector<std::string>>{{"--no-prompt"},
                                               {"--patience", "5"},
                                               {"--force-limit", "2"},
                                               {"--axis", "1"},
                                               {"--axis", "0"},
                                               {"--resume", "--out", in("out")}}) {
      if (of_device[0] == "--resume" && name == "max-stiffness") continue;  // its people have a journal too
      std::vector<std::string> arguments = {"experiment", name};
      arguments.insert(arguments.end(), of_device.begin(), of_device.end());
      expect_error(arguments, base::wrong_usage, of_device[0] + " is for a device; name one with --device");
    }
    expect_error({"experiment", name, "--device", "serial:/dev/none", "--subjects", "clipped"},
                 base::wrong_usage, "--subjects is for simulated people; leave --device out");
    expect_error(
        {"experiment", name, "--device", "serial:/dev/none", "--clip", name == "max-stiffness" ? "off" : "0"},
        base::wrong_usage, "--clip is for simulated people");
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

}  // namespace kmax::cli::experiment_command_test
