#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::plot_command_test {

using Plot = SimulatedCommandLine;

TEST_F(Plot, EveryColumnOverTheFirstBesideTheTable) {
  const std::string table = folder.write("run.csv", "time_s,force_n,gap_mm\n0,1,2\n1,2,3\n").string();
  EXPECT_EQ(kmax({"plot", table, "--json"}), done);
  EXPECT_EQ(document(), (Json{{"picture", in("run.svg")}}));
  for (const char* text : {"time (s)", "force (N)", "gap (mm)", "run.csv"})
    EXPECT_CONTAINS(folder.read("run.svg"), text);
}

TEST_F(Plot, ChosenColumns) {
  const std::string table = folder.write("run.csv", "time_s,force_n,gap_mm\n0,1,2\n1,2,3\n").string();
  EXPECT_EQ(kmax({"plot", table, "--x", "gap_mm", "--y", "force_n", "--out", in("a.svg")}), done);
  EXPECT_EQ(output, in("a.svg") + "\n");
  EXPECT_EQ(folder.read("a.svg").find("time (s)"), std::string::npos);
  EXPECT_EQ(kmax({"plot", table, "--together", "--out", in("b.png")}), done);
  expect_error({"plot", table, "--y", "farce_n"}, wrong_usage,
               "no column 'farce_n'; the columns are time_s, force_n");
  expect_error({"plot", table, "--x", "none"}, wrong_usage, "no column 'none'");
}

TEST_F(Plot, BadInput) {
  expect_error({"plot"}, wrong_usage, "table is required");
  expect_error({"plot", in("none.csv")}, wrong_usage, "cannot be read");
  expect_error({"plot", folder.write("one.csv", "a\n1\n").string()}, failed, "nothing to draw");
  expect_error({"plot", folder.write("run.csv", "a,b\n1,2\n").string(), "--out", in("a.pdf")}, wrong_usage,
               "must end in .svg or .png");
}

// A table from somebody else is data, whatever its columns are called.
TEST_F(Plot, ColumnNamesAreNoCommands) {
  const std::string table = folder.write("run.csv", "t,`touch " + in("done") + "`\n0,1\n1,2\n").string();
  EXPECT_EQ(kmax({"plot", table}), done);
  EXPECT_FALSE(std::filesystem::exists(folder / "done"));
}

}  // namespace kmax::cli::plot_command_test
