#include <fcntl.h>
#include <unistd.h>

#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::calibrate_command_test {

/// The program with a device that has a motor, fresh for every call.
class Calibrate : public SimulatedCommandLine {
 protected:
  int on_scene(const std::string& scene, std::vector<std::string> arguments,
               std::optional<simulation::Defect> defect = {}) {
    std::ostringstream out, messages;
    Context context(out, messages, [&](const std::string&, const device::Notice&) {
      auto link = std::make_unique<device::SimLink>(simulated_board::open_scene(scene));
      link->wait(std::chrono::milliseconds(300));
      if (defect) link->simulation().device().power().drives().plant(0, *defect);
      return link;
    });
    const int code = run(std::move(arguments), context);
    output = out.str();
    said = messages.str();
    return code;
  }
};

TEST_F(Calibrate, ADocumentHasEveryStepWithItsValues) {
  ASSERT_EQ(on_scene("dc_coreless_a", {"calibrate", "--steps", "electrical", "--json"}), base::done) << said;
  EXPECT_EQ(keys(), (std::vector<std::string>{"steps", "pass", "dry_run", "kept", "stored"}));
  const Json all = document();
  EXPECT_EQ(all["stored"], true);
  EXPECT_EQ(all["pass"], true);
  EXPECT_EQ(all["kept"], true);
  EXPECT_EQ(all["dry_run"], false);
  ASSERT_EQ(all["steps"].size(), 2u);
  EXPECT_EQ(all["steps"][0]["name"], "current_offsets");
  const Json& winding = all["steps"][1];
  EXPECT_EQ(winding["name"], "winding");
  EXPECT_EQ(winding["pass"], true);
  EXPECT_TRUE(winding["failure"].is_null());
  bool found = false;
  for (const Json& value : winding["values"]) {
    if (value["name"] != "motor.resistance") continue;
    found = true;
    EXPECT_NEAR(value["value"].get<double>(), 2.304, 0.07);
    EXPECT_GT(value["spread"].get<double>(), 0.0);
    EXPECT_EQ(value["unit"], "ohm");
    EXPECT_EQ(value["previous"], 1);
  }
  EXPECT_TRUE(found);
}

TEST_F(Calibrate, ADefectIsAVerdictWithItsName) {
  EXPECT_EQ(on_scene("gimbal_a", {"calibrate", "--json"}, simulation::Defect::phase_b_open),
            base::verdict_is_no)
      << said;
  const Json all = document();
  EXPECT_EQ(all["stored"], false);
  EXPECT_EQ(all["pass"], false);
  EXPECT_EQ(all["kept"], false);
  EXPECT_EQ(all["steps"][1]["failure"]["cause"], "phase_b_open");
  EXPECT_EQ(on_scene("gimbal_a", {"calibrate"}, simulation::Defect::phase_b_open), base::verdict_is_no);
  EXPECT_CONTAINS(said, "this takes about 3 minutes over a serial line of 115200 baud, less over CAN");
  EXPECT_CONTAINS(output, "phase_b_open");
  EXPECT_CONTAINS(output, "nothing was kept");
}

TEST_F(Calibrate, TheTableSaysWhatWasBefore) {
  ASSERT_EQ(on_scene("dc_coreless_b", {"calibrate", "--steps", "electrical", "--dry-run"}), base::done)
      << said;
  EXPECT_CONTAINS(output, "motor.resistance");
  EXPECT_CONTAINS(output, "was 1");
  EXPECT_CONTAINS(said, "this takes about 20 s over a serial line");
  EXPECT_CONTAINS(output, "dry run");
  ASSERT_EQ(on_scene("dc_coreless_b", {"calibrate", "--steps", "electrical", "--no-save"}), base::done)
      << said;
  EXPECT_CONTAINS(output, "kmax save");
}

TEST_F(Calibrate, AHandThatNobodyLendsEndsItWithEverythingAsBefore) {
  const int before = dup(STDIN_FILENO), nobody = open("/dev/null", O_RDONLY);
  ASSERT_EQ(dup2(nobody, STDIN_FILENO), STDIN_FILENO);
  EXPECT_EQ(on_scene("gimbal_a", {"calibrate", "--hand"}), base::failed) << output;
  dup2(before, STDIN_FILENO);
  close(before);
  close(nobody);
  EXPECT_CONTAINS(said, "then press Enter");
  EXPECT_CONTAINS(said, "nobody answered: --hand needs somebody at the terminal; the axis has been disarmed");
  EXPECT_CONTAINS(said, "all parameters are as before");
}

TEST_F(Calibrate, WithoutAMotorThereIsNothingToDo) {
  expect_error({"calibrate"}, base::failed, "nothing to calibrate");
  expect_error({"calibrate"}, base::failed, "kmax serve --scene gimbal_a");
}

TEST_F(Calibrate, BadOptionsAreWrongUsage) {
  for (const std::vector<std::string>& bad : std::vector<std::vector<std::string>>{{"--steps", "nothing"},
                                                                                   {"--travel", "0"},
                                                                                   {"--travel", "nan"},
                                                                                   {"--current", "-1"},
                                                                                   {"--current", "x"},
                                                                                   {"extra"}}) {
    std::vector<std::string> arguments = {"calibrate"};
    arguments.insert(arguments.end(), bad.begin(), bad.end());
    EXPECT_EQ(kmax(arguments), base::wrong_usage) << bad[0] << ": " << said;
  }
}

}  // namespace kmax::cli::calibrate_command_test
