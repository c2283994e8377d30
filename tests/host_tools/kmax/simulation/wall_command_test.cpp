#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::wall_command_test {

using Wall = SimulatedCommandLine;

TEST_F(Wall, APointAsTextAndAsADocument) {
  EXPECT_EQ(kmax({"wall", "--set", "wall.stiffness=8410", "--position", "-0.0001", "--json"}), base::done);
  EXPECT_EQ(keys(), (std::vector<std::string>{"force_n", "magnetic_force_n", "inside"}));
  EXPECT_NEAR(document()["force_n"].get<double>(), 0.841, 1e-9);
  EXPECT_EQ(document()["inside"], true);
  EXPECT_EQ(kmax({"wall", "--set", "wall.stiffness=8.41N/mm", "--position", "-0.0001"}), base::done);
  EXPECT_EQ(output, "force 0.841 N, of which magnetic 0 N, inside the wall\n");
}

TEST_F(Wall, ParametersAndTheAxisCount) {
  EXPECT_EQ(kmax({"wall", "--axis", "1", "--set", "wall.law=magnetic", "--set", "axis0.wall.law=none",
                  "--position", "0", "--json"}),
            base::done);
  EXPECT_EQ(document()["magnetic_force_n"], 2);
  EXPECT_EQ(
      kmax({"wall", "--set", "wall.law=adaptive", "--position", "0.001", "--velocity", "-0.5", "--json"}),
      base::done);
  const double approaching = document()["force_n"];
  EXPECT_EQ(kmax({"wall", "--set", "wall.law=adaptive", "--position", "0.001", "--json"}), base::done);
  EXPECT_GT(approaching, document()["force_n"].get<double>());
}

TEST_F(Wall, ATable) {
  folder.write("in.csv", "position_m\n-0.001\n");
  EXPECT_EQ(kmax({"wall", "--csv", in("in.csv"), "--out", in("out.csv"), "--json"}), base::done);
  EXPECT_EQ(document(), (Json{{"rows", 1}, {"out", in("out.csv")}}));
  EXPECT_EQ(folder.read("out.csv"), "position_m,velocity_m_per_s,force_n\n-0.001,0,1\n");
}

TEST_F(Wall, ATableOnStandardOutput) {
  folder.write("in.csv", "position_m\n-0.001\n");
  EXPECT_EQ(kmax({"wall", "--csv", in("in.csv"), "--out", "-"}), base::done) << said;
  EXPECT_EQ(output, "position_m,velocity_m_per_s,force_n\n-0.001,0,1\n");
  EXPECT_FALSE(std::filesystem::exists("-"));
  EXPECT_EQ(kmax({"wall", "--csv", in("in.csv"), "--out", "-", "--json"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "exclude each other");
}

TEST_F(Wall, PositionAndVelocityMayHaveAUnit) {
  const auto force = [&](const char* position, const char* velocity) {
    EXPECT_EQ(kmax({"wall", "--set", "wall.stiffness=8410", "--set", "wall.damping=1", "--position", position,
                    "--velocity", velocity, "--json"}),
              base::done)
        << said;
    return document()["force_n"].get<double>();
  };
  EXPECT_EQ(force("-0.1mm", "-5cm/s"), force("-0.0001", "-0.05"));
  expect_error({"wall", "--position", "-0.1kg"}, base::wrong_usage, "'kg' is not one of its units m, mm");
  expect_error({"wall", "--position", "2km"}, base::wrong_usage, "'km' is not one of its units m");
  expect_error({"wall", "--position", "2000"}, base::wrong_usage, "2000 m not in range -1000 .. 1000 m");
}

TEST_F(Wall, APicture) {
  EXPECT_EQ(kmax({"wall", "--picture", in("laws.svg"), "--json"}), base::done);
  EXPECT_EQ(document(), (Json{{"picture", in("laws.svg")}}));
  EXPECT_CONTAINS(folder.read("laws.svg"), "</svg>");
}

TEST_F(Wall, ExactlyOneThingIsAskedFor) {
  const std::string table = folder.write("in.csv", "position_m\n0\n").string();
  expect_error({"wall"}, base::wrong_usage, "exactly one of");
  expect_error({"wall", "--velocity", "1"}, base::wrong_usage, "exactly one of");
  expect_error({"wall", "--csv", table, "--out", in("o.csv"), "--position", "0"}, base::wrong_usage,
               "exactly one of");
  expect_error({"wall", "--picture", in("p.svg"), "--position", "0"}, base::wrong_usage, "exactly one of");
  expect_error({"wall", "--csv", table}, base::wrong_usage, "go together");
  expect_error({"wall", "--out", in("o.csv")}, base::wrong_usage, "go together");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST_F(Wall, BadNumbersAndParametersAreWrongUsage) {
  for (const char* bad : {"nan", "inf", "-inf", "1e400", "1kg", ""})
    EXPECT_EQ(kmax({"wall", "--position", bad}), base::wrong_usage) << bad;
  EXPECT_EQ(kmax({"wall", "--position", "0", "--velocity", "nan"}), base::wrong_usage);
  const auto set = [](const char* one) {
    return std::vector<std::string>{"wall", "--position", "0", "--set", one};
  };
  expect_error(set("wall.stifness=1"), base::wrong_usage, "did you mean wall.stiffness");
  expect_error(set("wall.stiffness=-1"), base::wrong_usage, "below");
  expect_error(set("wall.stiffness"), base::wrong_usage, "wall.stiffness");
  expect_error(set("measured.position=1"), base::wrong_usage, "read");
  expect_error(set("haptic.rate=333"), base::wrong_usage, "20000");
  EXPECT_EQ(kmax({"wall", "--axis", "2", "--position", "0"}), base::wrong_usage);
}

TEST_F(Wall, FilesThatCannotBeReadOrWrittenAreNamed) {
  const std::string table = folder.write("in.csv", "position_m\n0\nx\n").string();
  expect_error({"wall", "--csv", in("none.csv"), "--out", in("o.csv")}, base::wrong_usage, "cannot be read");
  expect_error({"wall", "--csv", table, "--out", in("o.csv")}, base::wrong_usage,
               "in.csv:3: position_m is 'x'");
  expect_error({"wall", "--picture", in("p.gif")}, base::wrong_usage, "must end in .svg or .png");
  expect_error({"wall", "--picture", in("no/p.svg")}, base::wrong_usage, "does not exist");
  EXPECT_EQ(folder.entries(), 1u);
}

}  // namespace kmax::cli::wall_command_test
