#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::wall_test_command_test {

using WallTestCommand = SimulatedCommandLine;

// What is known of the plain wall at 500 Hz without damping: it holds at 1 N/mm and oscillates at 6 N/mm.
TEST_F(WallTestCommand, ThePlainWallIsStableAt1AndUnstableAt6NewtonsPerMillimetre) {
  ASSERT_EQ(
      kmax({"experiment", "wall-test", "--stiffness", "1000,6000", "--repeats", "2", "--set",
            "haptic.rate=500", "--out", in("wall"), "--date", "2026-01-02", "--commit", "1a2b3c4", "--json"}),
      base::done)
      << said;
  const Json result = document();
  EXPECT_EQ(result["law"], "plain");
  EXPECT_EQ(result["haptic_rate_hz"], 500.0);
  ASSERT_EQ(result["cells"].size(), 8u);
  std::size_t unstable = 0;
  for (const Json& cell : result["cells"]) {
    EXPECT_EQ(cell["touches"], 2) << cell;
    if (cell["stiffness_n_per_m"] == 1000.0) {
      EXPECT_EQ(cell["stable"], 2) << cell;
    } else {
      unstable += 2 - cell["stable"].get<std::size_t>();
    }
  }
  // A handle that is let go leaves the wall.
  EXPECT_EQ(unstable, 6u) << "of 8 touches at 6 N/mm";
  ASSERT_EQ(result["limits"].size(), 5u);
  EXPECT_EQ(result["limits"][4]["touch"], "all");
  EXPECT_EQ(result["limits"][4]["by_both"]["words"], "1 N/mm");
  EXPECT_EQ(result["provenance"]["date"], "2026-01-02");
  EXPECT_CONTAINS(result["provenance"]["program"].get<std::string>(), "commit 1a2b3c4");
  EXPECT_EQ(result["provenance"]["seed"], 1);
  ASSERT_EQ(result["files"].size(), 8u);
  const Json files = result["files"];
  for (const Json& file : files) EXPECT_TRUE(std::filesystem::exists(file.get<std::string>()));
  EXPECT_CONTAINS(folder.read("wall/wall_test.md"), "Made on 2026-01-02 with kmax");
}

TEST_F(WallTestCommand, TheWallIsTheOneThatIsSet) {
  ASSERT_EQ(
      kmax({"experiment", "wall-test", "--stiffness", "3N/mm", "--repeats", "1", "--hold", "2s", "--set",
            "wall.law=magnetic", "--set", "wall.magnetic_coefficient=2", "--set", "haptic.rate=1kHz"}),
      base::done)
      << said;
  EXPECT_CONTAINS(output, "Wall of law 'magnetic' at 1000 Hz");
  EXPECT_CONTAINS(output, "wall.magnetic_coefficient=2");
  for (std::size_t begin = 0, end; (end = output.find('\n', begin)) != std::string::npos; begin = end + 1)
    EXPECT_LE(end - begin, 80u) << output.substr(begin, end - begin);
}

TEST_F(WallTestCommand, BadOptionsAreWrongUsageAndSayWhatIsAllowed) {
  const auto refusal = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"experiment", "wall-test"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(kmax(arguments), base::wrong_usage) << more[1];
    return said;
  };
  EXPECT_CONTAINS(refusal({"--stiffness", "3000,2000"}), "2000 N/m stands after 3000 N/m; list them rising");
  EXPECT_CONTAINS(refusal({"--stiffness", "0,1000"}), "0 N/m is not within 1 .. 1e6 N/m");
  EXPECT_CONTAINS(refusal({"--stiffness", "soft"}), "--stiffness soft: ");
  EXPECT_CONTAINS(refusal({"--repeats", "0"}), "--repeats");
  EXPECT_CONTAINS(refusal({"--hold", "1"}), "2 .. 60 s");
  EXPECT_CONTAINS(refusal({"--threshold", "nan"}), "--threshold");
  EXPECT_CONTAINS(refusal({"--force-threshold", "0"}), "--force-threshold");
  EXPECT_CONTAINS(refusal({"--date", "yesterday"}), "as in 2026-11-26");
  EXPECT_CONTAINS(refusal({"--set", "wall.stiffness=3"}), "--stiffness");
  EXPECT_CONTAINS(refusal({"--set", "motion.approach_speed=1"}), "several speeds");
  EXPECT_CONTAINS(refusal({"--set", "wall.law=none"}), "wall.law of axis 0 is none");
}

TEST_F(WallTestCommand, ADeviceIsNotSimulatedBeside) {
  const std::vector<std::string> arguments = {"experiment",  "wall-test", "--device",     "serial:/dev/none",
                                              "--no-prompt", "--set",     "device.mass=1"};
  EXPECT_EQ(
      kmax(arguments, [](const std::string&, const device::Notice&) { return device::make_sim_link(); }),
      base::wrong_usage);
  EXPECT_CONTAINS(said, "the device that --device names is as it is");
}

TEST_F(WallTestCommand, OnADeviceEverybodyTouchesItAsHeDoes) {
  const std::vector<std::string> arguments = {"experiment",  "wall-test",   "--device", "serial:/dev/none",
                                              "--no-prompt", "--stiffness", "1000",     "--repeats",
                                              "1",           "--hold",      "2",        "--json"};
  ASSERT_EQ(
      kmax(arguments, [](const std::string&, const device::Notice&) { return device::make_sim_link(); }),
      base::done)
      << said;
  const Json result = document();
  EXPECT_EQ(result["origin"], "measured");
  EXPECT_TRUE(result["provenance"]["seed"].is_null());
  for (const Json& cell : result["cells"]) EXPECT_NEAR(cell["contact_speed_m_per_s"].get<double>(), 0.2, 0.1);
}

}  // namespace kmax::cli::wall_test_command_test
