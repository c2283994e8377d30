#include <csignal>

#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::selftest_command_test {

class SelfTestCommand : public SimulatedCommandLine {
 protected:
  /// Arms and presses the emergency stop for a moment.
  static void leave_fault(device::SimLink& sim) {
    for (const std::uint16_t word : std::initializer_list<std::uint16_t>{0x00, 0x06, 0x07, 0x0F}) {
      sim.write_holding(device::Parameter::of<"drive.controlword">(0).address(), {&word, 1});
      sim.wait(std::chrono::milliseconds(50));
    }
    for (const bool pressed : {true, false}) {
      sim.simulation().device().power().press_emergency_stop(pressed);
      sim.wait(std::chrono::milliseconds(100));
    }
  }

  /// On a calibrated device with the motor of a scene, with a defect or none.
  int selftest(const std::string& defect, std::vector<std::string> arguments = {}) {
    simulation::Scene scene = simulated_board::open_scene(scene_name);
    scene.identified = true;
    for (simulation::SceneAxis& axis : scene.axes) {
      axis.motion.reset();
      axis.person.reset();
    }
    std::ostringstream out, messages;
    Context context(out, messages, [&](const std::string&, const device::Notice&) {
      auto sim = std::make_unique<device::SimLink>(scene);
      // A scene without a motor has no power stage.
      const auto power = [&]() -> auto& {
        return sim->simulation().device().power();
      };
      if (defect == "emergency_stop") power().press_emergency_stop(true);
      if (defect == "interrupted") std::raise(SIGINT);
      const auto named = simulation::defect_named(defect);
      if (named && !defect.empty()) power().drives().plant(0, *named);
      sim->wait(std::chrono::milliseconds(200));
      if (defect == "fault before") leave_fault(*sim);
      return sim;
    });
    arguments.insert(arguments.begin(), "selftest");
    const int code = run(std::move(arguments), context);
    output = out.str();
    said = messages.str();
    return code;
  }

  std::string scene_name = "dc_coreless_a";
};

TEST_F(SelfTestCommand, ShowsATableAndOneSentence) {
  EXPECT_EQ(selftest(""), base::done) << said;
  for (const char* name : {"link", "supply", "emergency stop", "gate driver", "temperature", "current sense",
                           "phases", "encoder"})
    EXPECT_CONTAINS("\n" + output, std::string("\n") + name);
  EXPECT_CONTAINS("\n" + output, "\nlink                   pass");
  EXPECT_CONTAINS(output, "No fault was found.");
  EXPECT_CONTAINS(output, "The handle was moved by 0.");
}

TEST_F(SelfTestCommand, SaysItAsOneDocument) {
  EXPECT_EQ(selftest("", {"--json"}), base::done) << said;
  const Json report = document();
  EXPECT_EQ(report["pass"], true);
  EXPECT_TRUE(report["faulty_part"].is_null());
  EXPECT_TRUE(report["fault_at_start"].is_null());
  EXPECT_EQ(report["checks"].size(), 9U);
  for (const Json& check : report["checks"]) {
    EXPECT_EQ(check["verdict"], "pass");
    EXPECT_TRUE(check["message"].is_string());
    EXPECT_TRUE(check["values"].is_array());
  }
  EXPECT_EQ(report["checks"][1]["values"][0]["name"], "voltage");
  EXPECT_NEAR(report["checks"][1]["values"][0]["value"].get<double>(), 24.0, 0.2);
  EXPECT_LT(report["largest_displacement_m"].get<double>(), 1e-3);
}

TEST_F(SelfTestCommand, AFaultEndsWithCodeThreeAndNamesThePart) {
  EXPECT_EQ(selftest("encoder_stuck", {"--json"}), base::verdict_is_no) << said;
  EXPECT_EQ(document()["pass"], false);
  EXPECT_EQ(document()["faulty_part"], "encoder");
  EXPECT_EQ(selftest("phase_b_open"), base::verdict_is_no);
  EXPECT_CONTAINS(output, "The faulty part is: motor winding or cable (B to C open)");
  EXPECT_EQ(selftest("emergency_stop"), base::verdict_is_no);
  EXPECT_CONTAINS(output, "The faulty part is: emergency stop");
  EXPECT_CONTAINS(output, "not judged");
}

TEST_F(SelfTestCommand, ThePersonOfTheDefaultSceneIsAskedToLetGo) {
  // It begins to move when the axis is armed, by some millimetres.
  EXPECT_EQ(kmax({"selftest"}), base::verdict_is_no) << said;
  EXPECT_CONTAINS(output, "The faulty part is: handle");
  EXPECT_CONTAINS(output, "no power stage");
  EXPECT_EQ(kmax({"selftest", "--json"}), base::verdict_is_no) << said;
  EXPECT_EQ(document()["faulty_part"], "handle");
  EXPECT_CONTAINS(document()["checks"][5]["message"].get<std::string>(),
                  "something else moved the handle; let go of it");
}

TEST_F(SelfTestCommand, ABoardWithoutPowerStageSaysWhatItCannotJudge) {
  scene_name = "touch";
  EXPECT_EQ(selftest(""), base::done) << said;
  EXPECT_CONTAINS(output, "No fault was found; not judged: supply");
  EXPECT_CONTAINS(output, "no power stage");
}

TEST_F(SelfTestCommand, AFaultThatWasThereBeforeIsShown) {
  EXPECT_EQ(selftest("fault before"), base::done) << said;
  EXPECT_CONTAINS("\n" + output, "\nfault before the test ");
  EXPECT_CONTAINS(output, "(cleared)");
  EXPECT_EQ(selftest("fault before", {"--json"}), base::done) << said;
  const Json before = document()["fault_at_start"];
  EXPECT_EQ(before["name"], "emergency_stop");
  EXPECT_EQ(before["cleared"], true);
  EXPECT_TRUE(before["message"].is_string());
  EXPECT_EQ(selftest(""), base::done);
  EXPECT_EQ(output.find("fault before"), std::string::npos);
}

TEST_F(SelfTestCommand, AnInterruptionSaysWhatHasBecomeOfTheDevice) {
  EXPECT_EQ(selftest("interrupted"), base::failed);
  EXPECT_CONTAINS(said, "interrupted; nothing was changed in the device");
}

TEST_F(SelfTestCommand, NobodyMovesTheHandleOrPressesTheStop) {
  EXPECT_EQ(selftest("", {"--hand", "--patience", "1", "--json"}), base::verdict_is_no) << said;
  EXPECT_EQ(document()["checks"].size(), 11U);
  EXPECT_CONTAINS(said, "move the handle by hand");
  EXPECT_CONTAINS(said, "press the emergency stop");
}

TEST_F(SelfTestCommand, WrongOptionsAreUsageErrors) {
  expect_error({"selftest", "--exchanges", "0"}, base::wrong_usage, "exchanges");
  expect_error({"selftest", "--hand", "--patience", "-1"}, base::wrong_usage, "patience");
  for (const char* number : {"nan", "-nan", "inf", "NaN"})
    expect_error({"selftest", "--patience", number}, base::wrong_usage, "patience");
}

}  // namespace kmax::cli::selftest_command_test
