#include "tests/host_tools/kmax/experiment/experiment_command_line.hpp"

namespace kmax::cli::deviation_command_test {

class DeviationCommand : public ExperimentCommandLine {
 protected:
  DeviationCommand() : ExperimentCommandLine("deviation") {}
};

TEST_F(DeviationCommand, TheDocumentHasEveryPairAndTheVerdict) {
  ASSERT_EQ(simulated({"--pulses", "1", "--rest", "0.2", "--out", in("results"), "--json"}), base::done)
      << said;
  EXPECT_EQ(keys(), (std::vector<std::string>{"origin", "circumstances", "pairs", "verdict",
                                              "without_stiffening", "paper_table_fits", "files"}));
  const Json all = document();
  EXPECT_EQ(all["origin"], "predicted");
  EXPECT_EQ(all["verdict"]["claim_met"], true);
  ASSERT_EQ(all["pairs"].size(), 16u);
  for (const Json& pair : all["pairs"]) {
    EXPECT_EQ(pair["touches"], 1);
    EXPECT_TRUE(pair["deviation_m"].is_number());
  }
  for (const Json& trend : all["verdict"]["trends"]) {
    EXPECT_EQ(trend["falls"], true);
    EXPECT_LT(trend["with_m"], trend["without_m"]);
  }
  EXPECT_EQ(all["without_stiffening"]["verdict"]["claim_met"], false);
  EXPECT_FALSE(all["paper_table_fits"].empty());
  expect_files(all["files"], 6);
  EXPECT_CONTAINS(folder.read("results/deviation.html"), "predicted");
}

TEST_F(DeviationCommand, AHandThatCannotStiffenIsAnswerNo) {
  EXPECT_EQ(
      simulated({"--expect-paper", "--pulses", "1", "--rest", "0.2", "--activation-gain", "0", "--json"}),
      base::verdict_is_no)
      << said;
  const Json trends = document()["verdict"]["trends"];
  ASSERT_EQ(trends.size(), 3u);
  for (const Json& trend : trends) {
    EXPECT_EQ(trend["falls"], false);
    EXPECT_TRUE(trend["rank_with_background_force"].is_null())
        << "values that are all the same have no order";
  }
  EXPECT_EQ(document()["files"], Json::array());
}

TEST_F(DeviationCommand, PicturesHaveTheKindAskedFor) {
  EXPECT_EQ(simulated({"--pulses", "1", "--rest", "0.2", "--out", in("results"), "--format", "png"}),
            base::done)
      << said;
  EXPECT_EQ(folder.read("results/deviation_trends.png").substr(1, 3), "PNG");
  EXPECT_CONTAINS(output, in("results/deviation.csv"));
}

TEST_F(DeviationCommand, ADeviceIsMeasured) {
  // Nothing hangs on this board's second axis, so that nothing gives way along the surface.
  EXPECT_EQ(on_device({"--expect-paper", "--pulses", "1", "--rest", "0.2", "--json"}), base::verdict_is_no)
      << said;
  const Json all = document();
  EXPECT_EQ(all["origin"], "measured");
  ASSERT_EQ(all["pairs"].size(), 16u);
  // This simulated person presses with 1 N and may lose the wall to an F_B that sets in faster than the push
  // can follow: such touches are not averaged. Where one was held, nothing gave way.
  std::size_t held = 0;
  for (const Json& pair : all["pairs"]) {
    if (pair["deviation_m"].is_null()) continue;
    EXPECT_EQ(pair["deviation_m"], 0);
    ++held;
  }
  EXPECT_GT(held, 0U);
  EXPECT_EQ(all["verdict"]["claim_met"], false);
  for (const Json& trend : all["verdict"]["trends"])
    EXPECT_EQ(trend["falls"].is_null(), trend["without_m"].is_null() || trend["with_m"].is_null()) << trend;
  EXPECT_FALSE(all.contains("without_stiffening")) << "only people that are simulated have a twin";
}

// At 20 N/mm no hand holds the plain wall still.
TEST_F(DeviationCommand, ATouchThatWasEndedIsExplained) {
  EXPECT_EQ(on_device({"--expect-paper", "--pulses", "1", "--rest", "0.2", "--stiffness", "20000"}),
            base::verdict_is_no)
      << said;
  EXPECT_CONTAINS(said, "F_B = 0 N, F_I = 1 N: not counted, the handle swung too far");
  EXPECT_CONTAINS(said, "left the wall before the 2.4 s of the touch were over");
}

TEST_F(DeviationCommand, APushThatLosesTheWallIsRefused) {
  expect_error({"experiment", "deviation", "--push", "0.5"}, base::wrong_usage, "push harder than every F_B");
}

TEST_F(DeviationCommand, BadValuesAreRefusedWithTheirOption) {
  expect_common_refusals();
  for (const char* option : {"--pulse", "--pause", "--rest", "--push", "--activation-gain"}) {
    expect_refused(option, "nan", "is not a number");
    expect_refused(option, "-1", "not in range");
  }
  for (const char* option : {"--pulse", "--pause", "--rest", "--push"})
    expect_refused(option, "0", "not in range");
  expect_refused("--pulses", "0", "not in range");
  expect_refused("--pulses", "1.5", "1.5");
}

}  // namespace kmax::cli::deviation_command_test
