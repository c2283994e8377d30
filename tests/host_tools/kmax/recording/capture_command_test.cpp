#include <algorithm>
#include <csignal>
#include <fstream>

#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/capturing_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::capture_command_test {

using Capture = SimulatedCommandLine;
using host_tools_test::CapturingLink;

TEST_F(Capture, WritesATableThatSaysItsUnits) {
  ASSERT_EQ(kmax({"capture", "--channels", "position,velocity,count,flags", "--samples", "50", "--interval",
                  "4", "--out", in("c.csv")}),
            base::done)
      << said;
  EXPECT_CONTAINS(output, "50 samples of axis 0, 0.2 ms apart, 0 of them before the trigger 'now'");
  const plot::CsvTable table = plot::read_csv(in("c.csv"));
  EXPECT_EQ(table.names,
            (std::vector<std::string>{"time_s", "tick", "position_m", "velocity_m_per_s", "count", "flags"}));
  ASSERT_EQ(table.columns[0].size(), 50u);
  for (std::size_t s = 0; s < 50; ++s) {
    ASSERT_NEAR(table.column("time_s")[s], static_cast<double>(s) * 4 / 20000, 1e-12);
    ASSERT_EQ(table.column("tick")[s], table.column("tick")[0] + 4 * static_cast<double>(s));
    // The simulated handle waits 2 cm outside, and its encoder answers.
    ASSERT_NEAR(table.column("position_m")[s], 0.02, 1e-4);
    ASSERT_EQ(table.column("flags")[s], firmware::capture_flag::count_valid);
  }
}

TEST_F(Capture, WithoutAFileTheTableIsTheOutputAndNothingElse) {
  ASSERT_EQ(kmax({"capture", "--channels", "force", "--samples", "3"}), base::done) << said;
  EXPECT_EQ(output.substr(0, output.find('\n')), "time_s,tick,force_n");
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 4);
  EXPECT_CONTAINS(said, "3 samples");
}

TEST_F(Capture, AContactWithTheArmedWallShowsBothSidesOfIt) {
  ASSERT_EQ(kmax({"capture", "--channels", "distance,force,flags", "--trigger", "contact", "--pre-trigger",
                  "100", "--samples", "400", "--arm", "--json"}),
            base::done)
      << said;
  const Json document = this->document();
  EXPECT_EQ(document["trigger"], "contact");
  EXPECT_EQ(document["samples"], 400);
  EXPECT_EQ(document["trigger_sample"], 100);
  EXPECT_EQ(document["file"], nullptr);
  const auto distance = document["channels"][0]["values"].get<std::vector<double>>();
  const auto force = document["channels"][1]["values"].get<std::vector<double>>();
  const auto flags = document["channels"][2]["values"].get<std::vector<unsigned>>();
  ASSERT_EQ(distance.size(), 400u);
  EXPECT_GT(distance[99], 0.0);
  EXPECT_LE(distance[100], 0.0);
  EXPECT_EQ(flags[99] & firmware::capture_flag::inside, 0u);
  EXPECT_NE(flags[100] & firmware::capture_flag::inside, 0u);
  EXPECT_NE(flags[100] & firmware::capture_flag::armed, 0u);
  EXPECT_EQ(force[0], 0.0);
  EXPECT_GT(*std::max_element(force.begin(), force.end()), 0.1);
  EXPECT_EQ(document["channels"][0]["minimum"], *std::min_element(distance.begin(), distance.end()));
}

TEST_F(Capture, NoTriggerIsAFailureThatNamesIt) {
  expect_error({"capture", "--trigger", "contact", "--timeout", "2"}, base::failed,
               "the trigger 'contact' did not come within 2 s");
}

TEST_F(Capture, WhatCannotBeMeantIsWrongUsage) {
  expect_error({"capture", "--channels", "forse"}, base::wrong_usage, "did you mean force");
  expect_error({"capture", "--channels", "force,count,supply,flags,distance"}, base::wrong_usage,
               "5 channels");
  expect_error({"capture", "--samples", "3073"}, base::wrong_usage, "at most 3072");
  expect_error({"capture", "--samples", "10", "--pre-trigger", "10"}, base::wrong_usage, "at most 9");
  expect_error({"capture", "--interval", "0"}, base::wrong_usage, "capture.interval");
  expect_error({"capture", "--trigger", "force"}, base::wrong_usage, "needs --level");
  expect_error({"capture", "--trigger", "fault", "--level", "1"}, base::wrong_usage, "not to 'fault'");
  for (const std::vector<std::string>& bad :
       std::vector<std::vector<std::string>>{{"--trigger", "magic"},
                                             {"--trigger", "6"},
                                             {"--level", "-1"},
                                             {"--timeout", "-1"},
                                             {"--timeout", "nan"},
                                             {"--timeout", "-nan"},
                                             {"--timeout", "inf"},
                                             {"--trigger", "force", "--level", "nan"},
                                             {"--samples", "-1"},
                                             {"--samples", "1.5"},
                                             {"--axis", "2"}}) {
    std::vector<std::string> arguments = {"capture"};
    arguments.insert(arguments.end(), bad.begin(), bad.end());
    EXPECT_EQ(kmax(arguments), base::wrong_usage) << bad[0] << " " << bad[1] << ": " << said;
  }
}

TEST_F(Capture, AFileThatCannotBeWrittenIsFoundBeforeAnybodyWaits) {
  EXPECT_EQ(kmax({"capture", "--trigger", "contact", "--timeout", "1000000", "--out", in("no/c.csv")}),
            base::failed);
  EXPECT_CONTAINS(said, "no/c.csv");
  // And a capture that fails leaves what was there, and nothing where nothing was.
  folder.write("old.csv", "old");
  EXPECT_EQ(kmax({"capture", "--trigger", "contact", "--timeout", "0.1", "--out", in("old.csv")}),
            base::failed);
  std::ifstream old(in("old.csv"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(old), {}), "old");
  EXPECT_EQ(kmax({"capture", "--trigger", "contact", "--timeout", "0.1", "--out", in("new.csv")}),
            base::failed);
  EXPECT_FALSE(std::filesystem::exists(in("new.csv")));
}

/// A link that the test keeps looking at after the command has ended.
struct Watched {
  int kmax(std::vector<std::string> arguments) {
    std::ostringstream out, messages;
    Context context(out, messages, [this](const std::string&, const device::Notice&) {
      auto made = std::make_unique<CapturingLink>();
      made->before_request = [this, seen = made.get()](int number) {
        if (number != interrupted_request) return;
        armed_before = seen->device.armed();
        std::raise(SIGINT);
      };
      made->at_end = [this](CapturingLink& ended) {
        commands = ended.commands;
        armed_at_end = ended.device.armed();
        state_at_end = ended.capture.readings().state;
      };
      return made;
    });
    const int code = run(std::move(arguments), context);
    said = messages.str();
    return code;
  }
  int interrupted_request = 0;
  std::vector<std::uint16_t> commands;
  bool armed_before = false, armed_at_end = true;
  firmware::CaptureState state_at_end{};
  std::string said;
};

TEST(CaptureCommand, CtrlCStopsTheCaptureInTheDeviceAndDisarms) {
  Watched watched;
  watched.interrupted_request = 60;
  EXPECT_EQ(watched.kmax({"capture", "--trigger", "fault", "--arm", "--timeout", "100"}), base::failed);
  EXPECT_CONTAINS(watched.said, "interrupted; the capture has been stopped");
  EXPECT_EQ(watched.commands, (std::vector<std::uint16_t>{1, 0}));
  EXPECT_EQ(watched.state_at_end, firmware::CaptureState::idle);
  EXPECT_TRUE(watched.armed_before);
  EXPECT_FALSE(watched.armed_at_end);
}

}  // namespace kmax::cli::capture_command_test
