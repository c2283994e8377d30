#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/kmax/simulated_command_line.hpp"

namespace kmax::cli {
namespace {

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
            (std::vector<std::string>{"scene", "state", "fault", "samples", "contact", "limited_share",
                                      "clipped_share", "simulated_s", "simulated_per_real_s"}));
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
}

TEST_F(Simulate, BadScenes) {
  expect_error({"simulate"}, wrong_usage, "scene is required");
  expect_error({"simulate", "tuoch"}, wrong_usage,
               "supplied are dc_coreless_a, dc_coreless_b, drone, free_handle, gimbal_a, "
               "gimbal_b, motor_axes, single_motor, touch, two_axes");
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
  EXPECT_CONTAINS(said, "the run ended in a fault");
  EXPECT_EQ(document()["fault"], "over_speed");
  EXPECT_EQ(document()["state"], "fault");
}

}  // namespace
}  // namespace kmax::cli
