#include "tests/host_tools/kmax/experiment/experiment_command_line.hpp"

namespace kmax::cli::resolution_command_test {

class ResolutionCommand : public ExperimentCommandLine {
 protected:
  ResolutionCommand() : ExperimentCommandLine("resolution") {}
};

TEST_F(ResolutionCommand, TheDocumentHasEveryHandAndTheVerdict) {
  ASSERT_EQ(simulated({"--touches", "1", "--speeds", "0.05,0.3", "--out", in("results"), "--json"}),
            base::done)
      << said;
  EXPECT_EQ(keys(), (std::vector<std::string>{"origin", "circumstances", "stiffness_n_per_m", "runs",
                                              "verdict", "variations", "files"}));
  const Json all = document();
  EXPECT_EQ(all["origin"], "calibrated") << "grip and delay were chosen for it";
  EXPECT_EQ(all["stiffness_n_per_m"], 1200);
  EXPECT_EQ(all["verdict"]["claim_met"], true);
  ASSERT_EQ(all["runs"].size(), 4u);
  for (const Json& run : all["runs"]) {
    ASSERT_EQ(run["cells"].size(), 6u) << "three resolutions at two speeds";
    for (const Json& cell : run["cells"]) EXPECT_EQ(cell["touches"], 3) << "one for each push";
  }
  EXPECT_EQ(all["runs"][0]["verdict"]["claim_met"], false) << "a firm hand without delay";
  EXPECT_FALSE(all["variations"].empty());
  expect_files(all["files"], 6);
  EXPECT_CONTAINS(folder.read("results/resolution.html"), "calibrated");
}

TEST_F(ResolutionCommand, AFirmHandWithoutDelayIsAnswerNo) {
  EXPECT_EQ(simulated({"--expect-paper", "--touches", "1", "--speeds", "0.05,0.3", "--grip", "1", "--delay",
                       "0", "--json"}),
            base::verdict_is_no)
      << said;
  EXPECT_EQ(document()["verdict"]["coarse_vibrates_at_every_speed"], false);
  EXPECT_TRUE(document()["verdict"]["onset_from_resolution"].is_null());
  EXPECT_EQ(document()["files"], Json::array());
}

TEST_F(ResolutionCommand, SpeedsOnOneSideOfTheOnsetLeaveAClaimOpen) {
  EXPECT_EQ(simulated({"--expect-paper", "--touches", "1", "--speeds", "0.05", "--json"}),
            base::verdict_is_no)
      << said;
  const Json verdict = document()["verdict"];
  EXPECT_EQ(verdict["coarse_vibrates_at_every_speed"], true);
  EXPECT_EQ(verdict["fine_is_still_below_onset"], true);
  EXPECT_TRUE(verdict["fine_vibrates_above_onset"].is_null()) << verdict;
  EXPECT_TRUE(verdict["claim_met"].is_null()) << verdict;
  for (const Json& variation : document()["variations"])
    EXPECT_TRUE(variation["verdict"]["fine_vibrates_above_onset"].is_null()) << variation;
}

TEST_F(ResolutionCommand, ADeviceIsMeasured) {
  // The board's person comes at one speed, whatever is asked for: never on both sides of the onset.
  EXPECT_EQ(on_device({"--expect-paper", "--speeds", "0.1", "--hold", "1", "--json"}), base::verdict_is_no)
      << said;
  const Json all = document();
  EXPECT_EQ(all["origin"], "measured");
  ASSERT_EQ(all["runs"].size(), 1u);
  EXPECT_FALSE(all["runs"][0].contains("grip")) << "nobody knows a real hand's";
  EXPECT_EQ(all["runs"][0]["cells"].size(), 3u);
  EXPECT_TRUE(all["variations"].empty());
}

TEST_F(ResolutionCommand, BadValuesAreRefusedWithTheirOption) {
  expect_common_refusals();
  for (const char* option : {"--hold", "--threshold", "--grip", "--delay", "--friction"}) {
    expect_refused(option, "nan", "is not a number");
    expect_refused(option, "-1", "not in range");
  }
  for (const char* option : {"--speeds", "--pushes"}) {
    expect_refused(option, "0.1,nan", "is not a number");
    expect_refused(option, "0.1,0", "not in range");
  }
  expect_refused("--hold", "0.5", "not in range");
  expect_refused("--rounding", "up", "up");
  expect_refused("--touches", "0", "not in range");
}

}  // namespace kmax::cli::resolution_command_test
