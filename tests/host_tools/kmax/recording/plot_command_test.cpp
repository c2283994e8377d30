#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::plot_command_test {

using Plot = SimulatedCommandLine;

TEST_F(Plot, EveryColumnOverTheFirstBesideTheTable) {
  const std::string table = folder.write("run.csv", "time_s,force_n,gap_mm\n0,1,2\n1,2,3\n").string();
  EXPECT_EQ(kmax({"plot", table, "--json"}), base::done);
  EXPECT_EQ(document(), (Json{{"picture", in("run.svg")}}));
  for (const char* text : {"time (s)", "force (N)", "gap (mm)", "run.csv"})
    EXPECT_CONTAINS(folder.read("run.svg"), text);
}

TEST_F(Plot, ChosenColumns) {
  const std::string table = folder.write("run.csv", "time_s,force_n,gap_mm\n0,1,2\n1,2,3\n").string();
  EXPECT_EQ(kmax({"plot", table, "--x", "gap_mm", "--y", "force_n", "--out", in("a.svg")}), base::done);
  EXPECT_EQ(output, in("a.svg") + "\n");
  EXPECT_EQ(folder.read("a.svg").find("time (s)"), std::string::npos);
  EXPECT_EQ(kmax({"plot", table, "--together", "--out", in("b.png")}), base::done);
  expect_error({"plot", table, "--y", "farce_n"}, base::wrong_usage,
               "no column 'farce_n'; the columns are time_s, force_n");
  expect_error({"plot", table, "--x", "none"}, base::wrong_usage, "no column 'none'");
}

TEST_F(Plot, WhatDoesNotChangeIsDrawnOnlyIfAskedFor) {
  const std::string table =
      folder.write("run.csv", "time_s,tick,force_n,gap_mm\n0,20,1,2\n1,40,2,2\n").string();
  EXPECT_EQ(kmax({"plot", table}), base::done);
  EXPECT_CONTAINS(said, "left out, as they do not change or count ticks: tick, gap_mm; --y draws them");
  const std::string picture = folder.read("run.svg");
  EXPECT_CONTAINS(picture, "force (N)");
  EXPECT_EQ(picture.find("gap (mm)"), std::string::npos);
  EXPECT_EQ(picture.find(">tick<"), std::string::npos);
  EXPECT_EQ(kmax({"plot", table, "--y", "gap_mm"}), base::done);
  EXPECT_EQ(said, "");
  EXPECT_CONTAINS(folder.read("run.svg"), "gap (mm)");
  // Flat lines are better than nothing.
  EXPECT_EQ(kmax({"plot", folder.write("flat.csv", "time_s,force_n\n0,1\n1,1\n").string()}), base::done);
  EXPECT_CONTAINS(said, "none of these columns changes: force_n");
  EXPECT_CONTAINS(folder.read("flat.svg"), "force (N)");
}

TEST_F(Plot, BadInput) {
  expect_error({"plot"}, base::wrong_usage, "table is required");
  expect_error({"plot", in("none.csv")}, base::wrong_usage, "cannot be read");
  expect_error({"plot", folder.write("one.csv", "a\n1\n").string()}, base::wrong_usage,
               "beside a there is no column of numbers; columns are separated by commas");
  expect_error({"plot", folder.write("one.csv", "a;b\n1;2\n").string()}, base::wrong_usage,
               "columns are separated by commas");
  expect_error({"plot", folder.write("bad.csv", "a,b\n1,2\n2,abc\n").string()}, base::wrong_usage,
               "bad.csv:3: b is 'abc'");
  expect_error({"plot", folder.write("bad.csv", "a,b\nx,2\n2,3\n").string()}, base::wrong_usage,
               "bad.csv:2: a is 'x'");
  expect_error({"plot", folder.write("bad.csv", "a,b\n1,nan\n2,\n").string(), "--y", "b"}, base::wrong_usage,
               "b over a has no number to draw");
  // A column of words is passed over.
  EXPECT_EQ(kmax({"plot", folder.write("run.csv", "a,b,why\n1,2,stable\n2,3,unstable\n").string()}),
            base::done)
      << said;
  expect_error({"plot", folder.write("run.csv", "a,b\n1,2\n").string(), "--out", in("a.pdf")},
               base::wrong_usage, "must end in .svg or .png");
}

// A table from somebody else is data, whatever its columns are called.
TEST_F(Plot, ColumnNamesAreNoCommands) {
  const std::string table = folder.write("run.csv", "t,`touch " + in("done") + "`\n0,1\n1,2\n").string();
  EXPECT_EQ(kmax({"plot", table}), base::done);
  EXPECT_FALSE(std::filesystem::exists(folder / "done"));
}

}  // namespace kmax::cli::plot_command_test
