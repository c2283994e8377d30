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
            done);
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
  EXPECT_EQ(kmax({"simulate", "touch", "--json"}), done);
  EXPECT_EQ(document()["contact"]["verdict"], "unstable");
  EXPECT_GT(document()["contact"]["peak_to_peak_m"].get<double>(), 0.165e-3);
  EXPECT_EQ(kmax({"simulate", "touch"}), done);
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
  EXPECT_EQ(kmax({"simulate", two, "--csv", in("r.csv"), "--picture", in("r.svg")}), done);
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
  EXPECT_EQ(kmax({"simulate", "noisy_encoder"}), done);
  EXPECT_CONTAINS(output, "edges of the encoder lost\n");
  EXPECT_CONTAINS(output, "encoder noise, encoder dropouts\n");
}

TEST_F(Simulate, BadScenes) {
  expect_error({"simulate"}, wrong_usage, "scene is required");
  expect_error({"simulate", "tuoch"}, wrong_usage, "supplied are compliant_structure, dc_coreless_a, ");
  expect_error({"simulate", scene("wall.stifness = 1\n")}, wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("wall.stiffness = -1\n")}, wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("measured.position = 0.0\n")}, wrong_usage, "can only be read");
  expect_error({"simulate", scene("haptic.rate = 333\n")}, wrong_usage, "[parameters] haptic.rate");
  expect_error({"simulate", scene("= 5\n")}, wrong_usage, "scene.toml:5:");
  expect_error({"simulate", scene("wall.position = 0.02\n")}, failed, "could not be armed: ");
}

TEST_F(Simulate, BadOutputs) {
  const std::string good = scene("");
  expect_error({"simulate", good, "--picture", in("r.gif")}, wrong_usage, "must end in .svg or .png");
  expect_error({"simulate", good, "--picture", in("no/r.svg")}, wrong_usage, "does not exist");
  expect_error({"simulate", good, "--csv", in("no/r.csv")}, failed, "r.csv: cannot be written");
  expect_error({"simulate", good, "--csv", folder.path().string()}, failed, "cannot be written");
}

TEST_F(Simulate, ARunThatEndsInAFaultIsAFailureWithItsResult) {
  const std::string fast =
      folder
          .write("fast.toml",
                 "duration = 0.1\n[device]\nstart_position = 0.05\nstart_velocity = -1.0\n"
                 "[parameters]\nvelocity.limit = 0.5\n")
          .string();
  EXPECT_EQ(kmax({"simulate", fast, "--json"}), failed);
  EXPECT_CONTAINS(said, "the run ended in a fault of the axis");
  EXPECT_EQ(document()["fault"], "over_speed");
  EXPECT_EQ(document()["state"], "fault");
}

}  // namespace kmax::cli::simulate_command_test
