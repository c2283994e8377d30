#include <fmt/format.h>

#include <algorithm>
#include <csignal>

#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::sweep_command_test {

class Sweep : public SimulatedCommandLine {
 protected:
  /// A person who holds a wall for little more than the second that is judged, and an encoder with noise.
  std::string scene(const std::string& encoder = "edge_noise = 0.3\n") {
    return folder
        .write("held.toml",
               "duration = 1.3\nseed = 7\n[device]\n[operator]\n[motion]\nhold_time = 1.05\n[encoder]\n" +
                   encoder + "[parameters]\nhaptic.rate = 500\n")
        .string();
  }
  std::size_t lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
};

TEST_F(Sweep, TheTableDoesNotDependOnTheJobs) {
  const auto table = [&](const std::string& jobs) {
    EXPECT_EQ(
        kmax({"sweep", scene(), "--set", "wall.stiffness=1N/mm..5N/mm:2N/mm", "--set",
              "operator.grip_stiffness=300,600", "--repeat", "2", "--jobs", jobs, "--out", in("t.csv")}),
        base::done)
        << said;
    return folder.read("t.csv");
  };
  const std::string one = table("1");
  EXPECT_EQ(lines(one), 1u + 3 * 2 * 2);
  EXPECT_TRUE(one == table("2"));
  EXPECT_CONTAINS(one,
                  "wall.stiffness,operator.grip_stiffness,repeat,seed,verdict,peak_to_peak_m,deepest_m,"
                  "largest_force_n,alarms,first_alarm_s,limited_share,clipped_share,outcome\n1000,300,0,7,");
  const plot::CsvTable read = [&] {
    EXPECT_EQ(kmax({"sweep", scene(), "--set", "wall.stiffness=1000,5000", "--repeat", "2"}), base::done);
    return folder.write("o.csv", output), plot::read_csv(folder / "o.csv");
  }();
  EXPECT_EQ(read.column("wall.stiffness"), (std::vector<double>{1000, 1000, 5000, 5000}));
  EXPECT_EQ(read.column("repeat"), (std::vector<double>{0, 1, 0, 1}));
  EXPECT_NE(read.column("peak_to_peak_m")[0], read.column("peak_to_peak_m")[1]) << "noise of its own";
  EXPECT_EQ(read.column("seed")[1], read.column("seed")[3]);
}

TEST_F(Sweep, ARowIsWhatSimulateGives) {
  EXPECT_EQ(kmax({"sweep", scene(), "--set", "wall.stiffness=4000", "--repeat", "2", "--json"}), base::done);
  const Json row = document()["runs"][1];
  EXPECT_EQ(row["settings"], (Json{{"wall.stiffness", 4000}}));
  EXPECT_EQ(kmax({"simulate", scene(), "--set", "wall.stiffness=4000", "--set",
                  fmt::format("seed={}", row["seed"].get<std::uint64_t>()), "--json"}),
            base::done)
      << said;
  const Json contact = document()["contact"];
  EXPECT_EQ(row["verdict"], contact["verdict"]);
  EXPECT_EQ(row["peak_to_peak_m"], contact["peak_to_peak_m"]);
  EXPECT_EQ(row["deepest_m"], contact["deepest_m"]);
  EXPECT_EQ(row["alarms"], document()["alarms"]);
  EXPECT_EQ(row["clipped_share"], document()["clipped_share"]);
  EXPECT_EQ(row["outcome"], "done");
  EXPECT_GT(row["largest_force_n"].get<double>(), 0.5);
}

TEST_F(Sweep, RangesAndListsInTheirUnits) {
  const auto values = [&](const std::string& set) {
    EXPECT_EQ(kmax({"sweep", scene(""), "--set", set, "--set", "measurement.window=0.5s", "--json"}),
              base::done)
        << said;
    Json found = Json::array();
    const Json all = document();
    for (const Json& run : all["runs"]) found.push_back(run["settings"].front());
    return found;
  };
  EXPECT_EQ(values("device.mass=40g..60g:10g"), (Json{0.04, 0.05, 0.06}));
  EXPECT_EQ(values("operator.grip_damping=1..1.3:0.1"), (Json{1, 1.1, 1.2, 1.3}));
  EXPECT_EQ(values("wall.stiffness=1000..2000:600"), (Json{1000, 1600}));
  EXPECT_EQ(values("wall.stiffness=1N/mm,500"), (Json{1000, 500}));
  EXPECT_EQ(values("wall.law=plain,magnetic"), (Json::array({"plain", "magnetic"})));
  EXPECT_EQ(values("motion.push_force=2"), (Json::array({2})));
}

TEST_F(Sweep, ARunThatCannotBeArmedIsARowThatSaysSo) {
  EXPECT_EQ(kmax({"sweep", "free_handle", "--set", "wall.position=-0.03,0.5", "--set", "duration=0.2"}),
            base::done)
      << said;
  EXPECT_EQ(lines(output), 3u) << output;
  EXPECT_CONTAINS(output, "-0.03,0.2,0,");
  EXPECT_CONTAINS(output, "inside the wall");
  EXPECT_CONTAINS(said, "1 of 2 runs were not armed: ");
  EXPECT_EQ(kmax({"sweep", "free_handle", "--set", "wall.position=0.4,0.5", "--set", "duration=0.2"}),
            base::failed);
  EXPECT_EQ(lines(output), 3u) << output;
  EXPECT_CONTAINS(said, "2 of 2 runs were not armed: ");
  EXPECT_CONTAINS(said, "inside the wall");
}

TEST_F(Sweep, ASeedThatIsSweptHasOneColumn) {
  EXPECT_EQ(kmax({"sweep", scene(), "--set", "seed=1,2"}), base::done) << said;
  EXPECT_TRUE(output.starts_with("repeat,seed,verdict,")) << output;
  EXPECT_CONTAINS(output, "\n0,1,");
  EXPECT_CONTAINS(output, "\n0,2,");
  EXPECT_EQ(kmax({"sweep", scene(), "--set", "seed=2", "--json"}), base::done);
  EXPECT_EQ(document()["runs"][0]["settings"]["seed"], document()["runs"][0]["seed"]);
}

TEST_F(Sweep, RepeatsWithoutNoiseAreEqualAndItIsSaid) {
  EXPECT_EQ(kmax({"sweep", scene(""), "--set", "wall.stiffness=1000", "--repeat", "2"}), base::done);
  EXPECT_CONTAINS(said, "has noise: the repeats of a combination are equal");
  EXPECT_EQ(kmax({"sweep", scene(), "--set", "wall.stiffness=1000", "--repeat", "2"}), base::done);
  EXPECT_EQ(said.find("the repeats"), std::string::npos);
}

TEST_F(Sweep, CtrlCKeepsWhatIsWhole) {
  // The first line of progress comes before the first run, and Ctrl-C with it.
  class InterruptingStream : public std::stringbuf {
   protected:
    std::streamsize xsputn(const char* text, std::streamsize count) override {
      std::raise(SIGINT);
      return std::stringbuf::xsputn(text, count);
    }
  } buffer;
  std::ostream messages(&buffer);
  std::ostringstream out;
  Context context(out, messages,
                  [](const std::string&, const device::Notice&) { return std::unique_ptr<device::Link>(); });
  EXPECT_EQ(
      run({"sweep", scene(), "--set", "wall.stiffness=1000..9000:100", "--jobs", "1", "--out", in("c.csv")},
          context),
      base::failed);
  const std::string table = folder.read("c.csv");
  EXPECT_CONTAINS(buffer.str(),
                  fmt::format("interrupted after {} of 81 runs; those are whole", lines(table) - 1));
  EXPECT_EQ(table.back(), '\n');
}

TEST_F(Sweep, WhatCannotBeMeantIsRefusedBeforeAnythingRuns) {
  const auto set = [&](const std::string& one) {
    return std::vector<std::string>{"sweep", scene(), "--set", one, "--out", in("never.csv")};
  };
  expect_error({"sweep", scene()}, base::wrong_usage, "--set is required");
  expect_error(set("wall.stifness=1..2:1"), base::wrong_usage, "did you mean wall.stiffness");
  expect_error(set("wall.stiffness=1..2"), base::wrong_usage, "has no step: write FROM..TO:STEP");
  expect_error(set("wall.stiffness=2..1:1"), base::wrong_usage, "FROM is above TO");
  expect_error(set("wall.stiffness=1..2:0"), base::wrong_usage, "the step must be above 0");
  expect_error(set("wall.stiffness=1..2:1e-9"), base::wrong_usage, "take a larger step");
  expect_error(set("wall.stiffness=1N/mm..2:1"), base::wrong_usage,
               "give all three numbers their unit, or none");
  expect_error(set("wall.stiffness=1kg,2kg"), base::wrong_usage, "'kg' is not one of its units N/m");
  expect_error(set("wall.stiffness=1,,2"), base::wrong_usage, "a value is missing");
  expect_error(set("wall.stiffness=1000,2,1N/mm"), base::wrong_usage, "1000 is given twice");
  expect_error(set("wall.law=plain,plain"), base::wrong_usage, "plain is given twice");
  expect_error(set("wall.stiffness=1000,-1"), base::wrong_usage, "wall.stiffness");
  expect_error(set("wall.law=plain..magnetic:1"), base::wrong_usage, "it is not a number; give a list");
  expect_error({"sweep", scene(), "--set", "seed=1", "--set", "seed=2"}, base::wrong_usage, "given twice");
  expect_error({"sweep", "free_handle", "--set", "operator.hand_mass=1"}, base::wrong_usage,
               "has no [operator]");
  expect_error({"sweep", scene(), "--set", "wall.stiffness=1..1000:1", "--set",
                "operator.hand_mass=1..1000:1", "--repeat", "2"},
               base::wrong_usage, "more than 1000000 runs");
  EXPECT_EQ(kmax({"sweep", scene(), "--set", "seed=1", "--repeat", "0"}), base::wrong_usage);
  EXPECT_FALSE(std::filesystem::exists(in("never.csv")));
}

TEST_F(Sweep, TheSceneIsNotOverwritten) {
  const std::string own = scene(), text = folder.read("held.toml");
  expect_error({"sweep", own, "--set", "seed=1", "--out", own}, base::wrong_usage,
               "is the same file as SCENE; give another name");
  EXPECT_EQ(folder.read("held.toml"), text);
}

}  // namespace kmax::cli::sweep_command_test
