#include <filesystem>

#include "host_tools/base/files.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"
#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::cli::bring_up_command_test {

class BringUpCommand : public SimulatedCommandLine {
 protected:
  /// On a board with a motor that is connected from the beginning.
  int bring_up(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "bring-up");
    std::ostringstream out, messages;
    Context context(
        out, messages, [this](const std::string&, const device::Notice&) -> std::unique_ptr<device::Link> {
          if (silent) throw device::LinkError("nobody answers");
          if (without_parity) {
            auto adapter =
                std::make_unique<selftest::WatchedLink>(simulated_board::open_scene("dc_coreless_a"), 0);
            adapter->without_parity = true;
            return adapter;
          }
          auto sim = std::make_unique<device::SimLink>(simulated_board::open_scene("dc_coreless_a"));
          sim->wait(std::chrono::milliseconds(200));
          return sim;
        });
    const int code = run(std::move(arguments), context);
    output = out.str();
    said = messages.str();
    return code;
  }
  bool silent = false, without_parity = false;
  host_tools_test::TemporaryFolder folder;
  std::string file = (folder.path() / "report.json").string();
};

TEST_F(BringUpCommand, GoesOnWhereItHasPassedAndStopsWhereItFails) {
  EXPECT_EQ(bring_up({"--report", file, "--yes", "--no-button", "--supply", "24", "--stage", "logic"}),
            base::done)
      << said;
  EXPECT_CONTAINS(output, "logic: passed");
  EXPECT_CONTAINS(output, "18 .. 25.5");
  EXPECT_CONTAINS(output, "next stage: gate_drivers");
  EXPECT_EQ(bring_up({"--report", file, "--yes", "--no-button"}), base::verdict_is_no) << said;
  EXPECT_CONTAINS(output, "gate_drivers: FAILED");
  EXPECT_CONTAINS(output, "although nothing should be connected: unplug the motor");
  EXPECT_EQ(output.find("logic:"), std::string::npos) << "it has passed";
  EXPECT_EQ(bring_up({"--report", file, "--yes", "--no-button", "--json"}), base::verdict_is_no);
  EXPECT_EQ(document()["passed"], false);
  EXPECT_EQ(document()["next_stage"], "gate_drivers");
  EXPECT_EQ(document()["stages"].size(), 2U);
  // Again, beside what it was.
  EXPECT_EQ(bring_up({"--report", file, "--yes", "--no-button", "--stage", "logic"}), base::done);
  EXPECT_CONTAINS(output, "was 24");
}

TEST_F(BringUpCommand, WhatCannotBeDoneIsSaidAndChangesNothing) {
  EXPECT_EQ(bring_up({"--report", file, "--yes", "--stage", "wall"}), base::wrong_usage) << said;
  EXPECT_CONTAINS(said, "'logic', which has not passed");
  EXPECT_FALSE(std::filesystem::exists(file) && std::filesystem::file_size(file) > 0);
  EXPECT_EQ(bring_up({"--stage", "walls"}), base::wrong_usage);
  EXPECT_EQ(bring_up({"--supply", "500"}), base::wrong_usage);
  base::write_file(file, "my notes");
  EXPECT_EQ(bring_up({"--report", file, "--yes"}), base::failed);
  EXPECT_CONTAINS(said, "not a report of this board");
  std::string problem;
  EXPECT_EQ(base::text_of(file, "", problem), "my notes");
  EXPECT_EQ(bring_up({"--report", "/nowhere/report.json", "--yes"}), base::failed);
  silent = true;
  EXPECT_EQ(bring_up({"--yes"}), base::failed);
  EXPECT_CONTAINS(said, "8E1");
}

TEST_F(BringUpCommand, AnAdapterWithoutParityIsFoundBeforeAnythingElse) {
  without_parity = true;
  EXPECT_EQ(bring_up({"--report", file, "--yes"}), base::failed);
  EXPECT_CONTAINS(said, "stage 'logic'");
  EXPECT_CONTAINS(said, "8E1 (even parity)");
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(BringUpCommand, ListsItsStagesWithoutADevice) {
  silent = true;
  EXPECT_EQ(bring_up({"--list"}), base::done);
  EXPECT_CONTAINS(output, "gate_drivers: ");
  EXPECT_EQ(bring_up({"--list", "--json"}), base::done);
  EXPECT_EQ(document()["stages"].size(), 7U);
}

}  // namespace kmax::cli::bring_up_command_test
