#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::simulate_command_test {

class Simulate : public SimulatedCommandLine {
 protected:
  std::string scene(const std::string& parameters, const std::string& duration = "0.2") {
    return folder
        .write("scene.toml",
               "duration = " + duration + "\n[device]\nstart_position = 0.01\n[parameters]\n" + parameters)
        .string();
  }
};

TEST_F(Simulate, DocumentTableAndPicture) {
  EXPECT_EQ(kmax({"simulate", scene("haptic.rate = 500\n"), "--csv", in("r.csv"), "--picture", in("r.svg"),
                  "--json"}),
            base::done);
  EXPECT_EQ(keys(),
            (std::vector<std::string>{"scene", "integrator", "parts", "state", "fault", "samples", "contact",
                                      "alarms", "first_alarm_s", "limited_share", "clipped_share",
                                      "lost_edges", "simulated_s", "simulated_per_real_s"}));
  EXPECT_EQ(document()["integrator"], "exact");
  EXPECT_EQ(document()["parts"], Json::parse(R"([["device"]])"));
  EXPECT_EQ(document()["scene"], "scene");
  EXPECT_EQ(document()["state"], "operation_enabled");
  EXPECT_EQ(document()["fault"], "none");
  EXPECT_EQ(document()["samples"], 100);
  EXPECT_TRUE(document()["contact"].is_null());
  const plot::CsvTable table = plot::read_csv(folder / "r.csv");
  EXPECT_EQ(table.names.size(), 10u);
  EXPECT_EQ(table.column("time_s").size(), 100u);
  EXPECT_NEAR(table.column("true_position_m").front(), 0.01, 1e-9);
  EXPECT_CONTAINS(folder.read("r.svg"), "</svg>");
}

TEST_F(Simulate, ASuppliedSceneWithAPersonIsJudged) {
  EXPECT_EQ(kmax({"simulate", "touch", "--json"}), base::done);
  EXPECT_EQ(document()["contact"]["verdict"], "unstable");
  EXPECT_GT(document()["contact"]["peak_to_peak_m"].get<double>(), 0.165e-3);
  EXPECT_EQ(kmax({"simulate", "touch"}), base::done);
  EXPECT_CONTAINS(output, "held contact: unstable");
  EXPECT_CONTAINS(output, "  integrator: exact\n");
  EXPECT_CONTAINS(output, "  axis 0 integrates: device, hand and arm, activation\n");
}

TEST_F(Simulate, TwoAxesAndAStructureHaveTheirColumns) {
  const std::string two =
      folder
          .write("two.toml",
                 "duration = 0.1\n[device]\nstart_position = 0.01\n[structure]\n"
                 "[axis1.device]\nstart_position = 0.02\n[parameters]\nhaptic.rate = 500\n"
                 "axis1.haptic.rate = 1000\n[integrator]\nkind = \"rk4\"\n")
          .string();
  EXPECT_EQ(kmax({"simulate", two, "--csv", in("r.csv"), "--picture", in("r.svg")}), base::done);
  EXPECT_CONTAINS(output, "  integrator: rk4, 10 substeps per 2 ms\n");
  EXPECT_CONTAINS(output, "  axis 0 integrates: device, structure\n");
  EXPECT_CONTAINS(output, "  axis 1 integrates: device\n");
  const plot::CsvTable table = plot::read_csv(folder / "r.csv");
  EXPECT_EQ(table.names.size(), 20u);
  EXPECT_EQ(table.column("tip_position_m").size(), 50u);
  EXPECT_NEAR(table.column("axis1_true_position_m").front(), 0.02, 1e-9);
  EXPECT_CONTAINS(folder.read("r.svg"), "axis 1: position");
}

TEST_F(Simulate, LostEdgesAreTold) {
  EXPECT_EQ(kmax({"simulate", "noisy_encoder"}), base::done);
  EXPECT_CONTAINS(output, "edges of the encoder lost\n");
  EXPECT_CONTAINS(output, "encoder noise, encoder dropouts\n");
}

TEST_F(Simulate, BadScenes) {
  expect_error({"simulate"}, base::wrong_usage,
               "a SCENE is missing: a TOML file, or one of compliant_structure, ");
  expect_error({"simulate", "tuoch"}, base::wrong_usage, "supplied are compliant_structure, dc_coreless_a, ");
  expect_error({"simulate", scene("wall.stifness = 1\n")}, base::wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("wall.stiffness = -1\n")}, base::wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("measured.position = 0.0\n")}, base::wrong_usage, "can only be read");
  expect_error({"simulate", scene("haptic.rate = 333\n")}, base::wrong_usage, "[parameters] haptic.rate");
  expect_error({"simulate", scene("= 5\n")}, base::wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("wall.position = 0.02\n")}, base::failed, "could not be armed: ");
}

TEST_F(Simulate, BadOutputs) {
  const std::string good = scene("");
  expect_error({"simulate", good, "--picture", in("r.gif")}, base::wrong_usage, "must end in .svg or .png");
  expect_error({"simulate", good, "--picture", in("no/r.svg")}, base::wrong_usage, "does not exist");
  expect_error({"simulate", good, "--csv", in("no/r.csv")}, base::failed, "r.csv: cannot be written");
  expect_error({"simulate", good, "--csv", folder.path().string()}, base::failed, "cannot be written");
}

TEST_F(Simulate, ARunThatEndsInAFaultIsAFailureWithItsResult) {
  const std::string fast =
      folder
          .write("fast.toml",
                 "duration = 0.1\n[device]\nstart_position = 0.05\nstart_velocity = -1.0\n"
                 "[parameters]\nvelocity.limit = 0.5\n")
          .string();
  EXPECT_EQ(kmax({"simulate", fast, "--json"}), base::failed);
  EXPECT_CONTAINS(said, "the run ended in a fault of the axis");
  EXPECT_EQ(document()["fault"], "over_speed");
  EXPECT_EQ(document()["state"], "fault");
}

TEST_F(Simulate, ASettingStandsInPlaceOfWhatTheSceneSays) {
  const auto table = [&](std::vector<std::string> settings) {
    std::vector<std::string> arguments{"simulate", scene("haptic.rate = 500\n"), "--csv", in("r.csv")};
    settings.push_back("device.friction=0.01");
    for (const std::string& one : settings) arguments.insert(arguments.end(), {"--set", one});
    EXPECT_EQ(kmax(arguments), base::done) << said;
    return folder.read("r.csv");
  };
  const std::string plain = table({"device.start_velocity=-30cm/s"});
  EXPECT_TRUE(plain == table({"device.start_velocity = -0.3"}));
  EXPECT_TRUE(plain != table({"device.start_velocity=-30cm/s", "device.damping=1"}));
  EXPECT_TRUE(plain != table({"device.start_velocity=-30cm/s", "wall.stiffness=3N/mm"}));
  EXPECT_TRUE(plain == table({"axis0.device.start_velocity=-0.3", "axis0.wall.stiffness=1N/mm"}));
  EXPECT_EQ(kmax({"simulate", scene(""), "--set", "duration=100ms", "--json"}), base::done);
  EXPECT_EQ(document()["samples"], 2000);
}

TEST_F(Simulate, ASceneMaySayItsNumbersWithUnits) {
  const auto table = [&](const std::string& text) {
    const std::string path = folder.write("u.toml", "duration = 0.05\n" + text).string();
    EXPECT_EQ(kmax({"simulate", path, "--csv", in("r.csv")}), base::done) << said;
    return folder.read("r.csv");
  };
  EXPECT_TRUE(table("[device]\nmass = 0.06\nstart_position = 0.005\nstart_velocity = -0.2\n") ==
              table("[device]\nmass = \"60 g\"\nstart_position = \"5mm\"\nstart_velocity = \"-20 cm/s\"\n"));
}

TEST_F(Simulate, ThePersonAimsAtAWallThatIsSetWithAUnit) {
  EXPECT_EQ(kmax({"simulate", "touch", "--set", "wall.position=5mm", "--set", "wall.law=none", "--set",
                  "motion.hold_time=1.5s", "--json"}),
            base::done);
  const Json with_unit = document()["contact"];
  EXPECT_EQ(kmax({"simulate", "touch", "--set", "wall.position=0.005", "--set", "wall.law=none", "--set",
                  "motion.hold_time=1.5", "--json"}),
            base::done);
  EXPECT_EQ(document()["contact"], with_unit);
  EXPECT_NE(with_unit["verdict"], "no_contact");
}

TEST_F(Simulate, SettingsThatCannotBeMeant) {
  const auto set = [&](const std::string& one) {
    return std::vector<std::string>{"simulate", scene(""), "--set", one};
  };
  expect_error(set("operator.grip_stifness=800"), base::wrong_usage,
               "'operator.grip_stifness' is neither a key of a scene nor a parameter; did you mean "
               "operator.grip_stiffness");
  expect_error(set("wall.stifness=800"), base::wrong_usage, "did you mean wall.stiffness");
  expect_error(set("sed=2"), base::wrong_usage, "did you mean seed");
  expect_error(set("operator.grip_stiffness=800"), base::wrong_usage,
               "--set operator.grip_stiffness=800: " + in("scene.toml") + " has no [operator]");
  expect_error(set("axis1.device.mass=1"), base::wrong_usage, "has no [axis1.device]");
  expect_error(set("device.mass=60kgg"), base::wrong_usage, "'kgg' is not one of its units kg, g");
  expect_error(set("device.mass=-1"), base::wrong_usage, "allowed is a number from 0.0001 to 100 kg");
  expect_error(set("wall.stiffness=1kg"), base::wrong_usage, "'kg' is not one of its units N/m");
  expect_error(set("wall.law=magnetik"), base::wrong_usage, "did you mean magnetic");
  expect_error(set("identified=perhaps"), base::wrong_usage, "allowed is true or false");
  expect_error(set("seed=-1"), base::wrong_usage, "a whole number from 0");
  expect_error(set("integrator.kind=rk5"), base::wrong_usage, "did you mean rk4");
  expect_error(set("device.mass"), base::wrong_usage, "write NAME=VALUE");
  expect_error({"simulate", scene(""), "--set", "seed=1", "--set", "seed=2"}, base::wrong_usage,
               "given twice");
}

TEST_F(Simulate, ANameOfBothIsTheScenesUnlessSaidOtherwise) {
  // A wrong mass in the firmware does not make the handle heavier.
  const auto run = [&](const std::string& one) {
    EXPECT_EQ(kmax({"simulate", scene(""), "--set", "device.start_velocity=-0.1", "--set", one, "--csv",
                    in("r.csv")}),
              base::done)
        << said;
    return folder.read("r.csv");
  };
  EXPECT_TRUE(run("parameters.device.mass=1kg") == run("parameters.device.mass=2kg"));
  EXPECT_TRUE(run("device.mass=1kg") != run("device.mass=2kg"));
}

TEST_F(Simulate, AMotorThatIsNotCalibratedSaysWhatToDo) {
  expect_error({"simulate", "gimbal_a"}, base::failed, "'kmax simulate gimbal_a --set identified=true'");
  EXPECT_CONTAINS(said, "'kmax serve --scene gimbal_a --serial /tmp/kmax'");
  EXPECT_EQ(kmax({"simulate", "gimbal_a", "--set", "identified=true", "--set", "duration=0.1"}), base::done)
      << said;
}

TEST_F(Simulate, TheKeysAreAPageOrADocument) {
  EXPECT_EQ(kmax({"simulate", "--keys"}), base::done);
  EXPECT_CONTAINS(output, "\n## [operator], per axis\n");
  EXPECT_CONTAINS(output, "\n| `grip_stiffness` | N/m | 540 | 1 .. 1e7 | k1, stiffness of the grip |\n");
  EXPECT_EQ(kmax({"simulate", "--keys", "--json"}), base::done);
  EXPECT_EQ(document()["keys"][0]["key"], "name");
  expect_error({"simulate", "touch", "--keys"}, base::wrong_usage, "give it alone");
}

TEST_F(Simulate, WritesNoFileOverAnother) {
  const std::string own = folder.write("own.toml", "duration = 0.1\n[device]\n").string();
  expect_error({"simulate", own, "--csv", own}, base::wrong_usage,
               "--csv " + own + " is the same file as SCENE");
  expect_error({"simulate", own, "--csv", in("s.svg"), "--picture", in("s.svg")}, base::wrong_usage,
               "is the same file as --csv");
  EXPECT_CONTAINS(folder.read("own.toml"), "duration");
  EXPECT_FALSE(std::filesystem::exists(in("s.svg")));
}

}  // namespace kmax::cli::simulate_command_test
