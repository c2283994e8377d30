#include "host_tools/kmax/experiment/experiment_study.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <sstream>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::experiment_study_test {

using host_tools_test::thrown_message;

class ExperimentStudy : public testing::Test {
 protected:
  int print(bool claim_met = true, bool expect_paper = false) {
    StudyReport study{claim_met, {{"origin", "predicted"}}, {"One.", "Two."}, {{"A table", {"a"}, {{"1"}}}}};
    return print_study(context, study, {"out/a.csv", "out/b.svg"}, expect_paper);
  }

  std::ostringstream out, messages;
  Context context{out, messages,
                  [](const std::string&, const device::Notice&) { return std::unique_ptr<device::Link>(); }};
};

TEST_F(ExperimentStudy, TheTextIsParagraphsTablesAndTheFilesNames) {
  EXPECT_EQ(print(), base::done);
  EXPECT_EQ(out.str().rfind("One.\n\nTwo.\n\nA table\n", 0), 0u) << out.str();
  EXPECT_TRUE(out.str().ends_with("\n\nout/a.csv\nout/b.svg\n")) << out.str();
}

TEST_F(ExperimentStudy, TheDocumentEndsWithTheFiles) {
  context.json = true;
  EXPECT_EQ(print(), base::done);
  EXPECT_EQ(Json::parse(out.str()),
            (Json{{"origin", "predicted"}, {"files", Json{"out/a.csv", "out/b.svg"}}}));
}

TEST_F(ExperimentStudy, AClaimThatIsNotMetIsTheAnswerNoWhereThePaperIsExpected) {
  EXPECT_EQ(print(false), base::done);
  EXPECT_EQ(print(true, true), base::done);
  EXPECT_EQ(print(false, true), base::verdict_is_no);
  context.json = true;
  EXPECT_EQ(print(false, true), base::verdict_is_no);
}

TEST_F(ExperimentStudy, FitsIntoATerminal) {
  StudyReport study{true,
                    {},
                    {"Words that go on and on and on, and would be cut by a terminal."},
                    {{"", {"a long heading", "another one"}, {{"some words", "1"}}}}};
  context.fixed_width = 20;
  print_study(context, study, {}, false);
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 20u) << line;
}

TEST_F(ExperimentStudy, ProgressIsShownInItsWords) {
  const base::Interruption interruption;
  EXPECT_EQ(simulate_study(context, interruption, force_pairs_words,
                           [](const experiment::ProgressReport& progress) {
                             progress(3, 16);
                             return 7;
                           }),
            7);
  EXPECT_CONTAINS(messages.str(), "3 of 16 pairs of forces");
}

TEST_F(ExperimentStudy, SettingsThatAreRefusedAreWrongUsage) {
  const base::Interruption interruption;
  const auto refuse = [](const experiment::ProgressReport&) -> int {
    throw std::invalid_argument("push harder");
  };
  EXPECT_EQ(
      thrown_message<UsageError>([&] { simulate_study(context, interruption, force_pairs_words, refuse); }),
      "push harder");
}

TEST_F(ExperimentStudy, CtrlCEndsASimulation) {
  const base::Interruption interruption;
  const auto interrupted = [](const experiment::ProgressReport& progress) {
    std::raise(SIGINT);
    progress(1, 16);
    return 0;
  };
  EXPECT_EQ(thrown_message<ExperimentInterrupted>(
                [&] { simulate_study(context, interruption, force_pairs_words, interrupted); }),
            interrupted_study);
}

TEST_F(ExperimentStudy, TheGainIsEverybodysOnlyIfItIsGiven) {
  simulation::DeviceModel device;
  PeopleOptions options{"clipped", -1.0, 2.5};
  const std::vector<simulation::OperatorModel> own = people_of(options, device);
  ASSERT_GT(own.size(), 1u);
  EXPECT_EQ(device.force_limit, 2.5);
  options.activation_gain = 0.0;
  const std::vector<simulation::OperatorModel> given = people_of(options, device);
  ASSERT_EQ(given.size(), own.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    EXPECT_GT(own[i].activation_gain, 0.0);
    EXPECT_EQ(given[i].activation_gain, 0.0);
  }
}

}  // namespace kmax::cli::experiment_study_test
