#include "tests/host_tools/kmax/experiment/experiment_command_line.hpp"

namespace kmax::cli::jitter_command_test {

class JitterCommand : public ExperimentCommandLine {
 protected:
  JitterCommand() : ExperimentCommandLine("jitter") {}
};

TEST_F(JitterCommand, TheDocumentHasEveryPairAndTheVerdict) {
  ASSERT_EQ(simulated({"--touches", "1", "--out", in("results"), "--json"}), base::done) << said;
  EXPECT_EQ(keys(),
            (std::vector<std::string>{"origin", "circumstances", "pairs", "verdict", "variations", "files"}));
  const Json all = document();
  EXPECT_EQ(all["origin"], "predicted");
  EXPECT_EQ(all["verdict"]["claim_met"], true);
  ASSERT_EQ(all["pairs"].size(), 16u);
  for (const Json& pair : all["pairs"]) {
    EXPECT_EQ(pair["touches"], 1);
    EXPECT_TRUE(pair["jitter_m"].is_number());
    EXPECT_EQ(pair["adjustment_time_s"].is_null(), pair["not_settled"] != 0);
  }
  ASSERT_FALSE(all["variations"].empty());
  expect_files(all["files"], 6);
  EXPECT_CONTAINS(folder.read("results/jitter.html"), "predicted");
  EXPECT_TRUE(std::filesystem::exists(folder / "results" / "jitter_trends.svg"));
}

TEST_F(JitterCommand, AHandThatCannotStiffenIsAnswerNo) {
  EXPECT_EQ(simulated({"--expect-paper", "--touches", "1", "--activation-gain", "0", "--json"}),
            base::verdict_is_no)
      << said;
  EXPECT_EQ(document()["verdict"]["claim_met"], false);
  EXPECT_EQ(document()["verdict"]["jitter_falls"], false);
  EXPECT_EQ(document()["files"], Json::array());
}

TEST_F(JitterCommand, ADeviceIsMeasured) {
  const int code = on_device({"--expect-paper", "--touches", "1", "--window", "0.6", "--json"});
  ASSERT_TRUE(code == base::done || code == base::verdict_is_no) << said;
  const Json all = document();
  EXPECT_EQ(all["verdict"]["claim_met"] == true, code == base::done);
  EXPECT_EQ(all["origin"], "measured");
  EXPECT_EQ(all["pairs"].size(), 16u);
  EXPECT_CONTAINS(all["circumstances"].get<std::string>(), "force limit 3.3 N");
  EXPECT_CONTAINS(all["circumstances"].get<std::string>(), "1 touch per pair");
  EXPECT_TRUE(all["variations"].empty()) << "only people that are simulated can be varied";
}

// In half a second nobody settles, and a time that nobody has neither falls nor does not.
TEST_F(JitterCommand, WhatWasNotShownIsNullAndNotNo) {
  EXPECT_EQ(simulated({"--expect-paper", "--touches", "1", "--window", "0.5", "--json"}), base::verdict_is_no)
      << said;
  const Json verdict = document()["verdict"];
  EXPECT_EQ(verdict["jitter_falls"], true);
  EXPECT_TRUE(verdict["adjustment_time_falls"].is_null()) << verdict;
  EXPECT_TRUE(verdict["claim_met"].is_null()) << verdict;
  EXPECT_CONTAINS(document()["circumstances"].get<std::string>(), "1 touch each");
}

TEST_F(JitterCommand, APersonWhoNeverComesToTheWallIsAFailure) {
  board.axes[0].motion.reset();
  board.axes[0].start.position = 0.02;
  EXPECT_EQ(on_device({"--expect-paper", "--touches", "1", "--window", "0.6", "--patience", "3", "--json"}),
            base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "nobody touched the wall within 3 s");
}

TEST_F(JitterCommand, BadValuesAreRefusedWithTheirOption) {
  expect_common_refusals();
  for (const char* option : {"--window", "--push", "--speed", "--reaction", "--activation-gain"}) {
    expect_refused(option, "nan", "is not a number");
    expect_refused(option, "-1", "not in range");
  }
  expect_refused("--reaction", "1.1", "not in range");
  expect_refused("--window", "0.4", "not in range");
  expect_refused("--touches", "0", "not in range");
  expect_refused("--touches", "1.5", "1.5");
}

}  // namespace kmax::cli::jitter_command_test
