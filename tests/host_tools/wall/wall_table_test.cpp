#include "host_tools/wall/wall_evaluation.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sys/stat.h>

#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::wall::wall_table_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

/// 1000 N/m at 0, plain: the defaults.
class WallTable : public testing::Test {
 protected:
  std::string table(const std::string& text) {
    folder.write("in.csv", text);
    rows = evaluate_table(evaluator, folder / "in.csv", folder / "out.csv");
    return folder.read("out.csv");
  }
  std::string refused(const std::string& text) {
    folder.write("in.csv", text);
    folder.write("out.csv", "as it was");
    const auto what = thrown_message<plot::CsvError>(
        [&] { evaluate_table(evaluator, folder / "in.csv", folder / "out.csv"); });
    EXPECT_EQ(folder.read("out.csv"), "as it was");
    EXPECT_EQ(folder.entries(), 2u) << "something was left behind";
    return what;
  }

  TemporaryFolder folder;
  WallEvaluator evaluator{firmware::ParameterValues{}};
  std::size_t rows = 0;
};

const std::string header = "position_m,velocity_m_per_s,force_n\n";

TEST_F(WallTable, OneForceForEachRow) {
  EXPECT_EQ(table("position_m,velocity_m_per_s\n-0.001,0\n0.002,-0.5\n"),
            header + "-0.001,0,1\n0.002,-0.5,0\n");
  EXPECT_EQ(rows, 2u);
  EXPECT_EQ(folder.entries(), 2u);
}

TEST_F(WallTable, TakesWhatSpreadsheetsWrite) {
  const std::string expected = header + "-0.001,0.25,1\n0.002,-0.5,0\n";
  EXPECT_EQ(table("position_m,velocity_m_per_s\r\n-0.001,0.25\r\n0.002,-0.5\r\n"), expected);
  EXPECT_EQ(table("position_m,velocity_m_per_s\n-0.001,0.25\n0.002,-0.5"), expected) << "no last newline";
  EXPECT_EQ(table("velocity_m_per_s,position_m\n0.25,-0.001\n-0.5,0.002\n"), expected) << "swapped";
  EXPECT_EQ(table("t,position_m,note,velocity_m_per_s,\n0,-1e-3,\"x\",+0.25,\n,2E-3,,-.5,\n"), expected);
  EXPECT_EQ(
      table("# made by hand\n\n position_m ,\tvelocity_m_per_s\n \t\n -0.001 , 0.25 \n#\n0.002,-0.5\n\n"),
      expected);
  EXPECT_EQ(table("position_m\n-0.001\n"), header + "-0.001,0,1\n") << "velocity is 0 without its column";
  EXPECT_EQ(table("position_m,velocity_m_per_s\n"), header) << "no rows";
  EXPECT_EQ(rows, 0u);
}

TEST_F(WallTable, WhatIsNoNumberIsNamedWithFileLineColumnAndValue) {
  for (const char* bad :
       {"nan", "inf", "-inf", "1e400", "0x10", "\"0.1\"", "1.5mm", "", "+-1", "++1", "1 2"}) {
    const auto what = refused(fmt::format("position_m,velocity_m_per_s\n0,0\n{},0\n", bad));
    EXPECT_CONTAINS(what, fmt::format("in.csv:3: position_m is '{}'", bad));
    EXPECT_CONTAINS(refused(fmt::format("position_m,velocity_m_per_s\r\n0,{}\r\n", bad)),
                    fmt::format("in.csv:2: velocity_m_per_s is '{}'", bad));
  }
}

TEST_F(WallTable, RowsMustHaveAsManyFieldsAsTheHeader) {
  EXPECT_CONTAINS(refused("position_m,velocity_m_per_s\n1\n"), ":2: 1 fields where the first line names 2");
  EXPECT_CONTAINS(refused("position_m,velocity_m_per_s\n1,2,3\n"), ":2: 3 fields where");
  EXPECT_CONTAINS(refused("position_m,velocity_m_per_s\n1,2,\n"), ":2: 3 fields where");
  EXPECT_CONTAINS(refused("a,position_m\n1,2\n,\n"), ":3: position_m is ''");
}

TEST_F(WallTable, HeaderMustNameThePositionOnce) {
  EXPECT_CONTAINS(refused("0.001,0.1\n"), "it reads '0.001,0.1'");
  EXPECT_CONTAINS(refused("position,velocity_m_per_s\n0,0\n"), "must name the columns");
  EXPECT_CONTAINS(refused("position_m,position_m\n1,2\n"), "two columns are named position_m");
  EXPECT_CONTAINS(refused("velocity_m_per_s,position_m,velocity_m_per_s\n1,2,3\n"),
                  "two columns are named velocity");
  EXPECT_CONTAINS(refused(""), "the file is empty");
  EXPECT_CONTAINS(refused("\n# nothing\n"), "the file is empty");
  EXPECT_CONTAINS(refused(std::string("\0\0,\xff", 4)), "must name the columns");
}

TEST_F(WallTable, MissingFilesAndFoldersAreErrorsOfThisKind) {
  EXPECT_CONTAINS(thrown_message<plot::CsvError>(
                      [&] { evaluate_table(evaluator, folder / "none.csv", folder / "out.csv"); }),
                  "none.csv: cannot be read");
  EXPECT_CONTAINS(
      thrown_message<plot::CsvError>([&] { evaluate_table(evaluator, folder.path(), folder / "out.csv"); }),
      "cannot be read");
  folder.write("in.csv", "position_m\n0\n");
  EXPECT_CONTAINS(thrown_message<plot::CsvError>(
                      [&] { evaluate_table(evaluator, folder / "in.csv", folder / "no/out.csv"); }),
                  "out.csv: cannot be written");
  EXPECT_CONTAINS(
      thrown_message<plot::CsvError>([&] { evaluate_table(evaluator, folder / "in.csv", folder.path()); }),
      "not a regular file");
  EXPECT_EQ(folder.entries(), 1u);
}

// What would otherwise happen to /dev/null or /dev/stdout when root names them.
TEST_F(WallTable, ASpecialFileIsNotReplaced) {
  folder.write("in.csv", "position_m\n0\n");
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink(folder / "pipe", folder / "link");
  for (const char* name : {"pipe", "link"})
    EXPECT_CONTAINS(
        thrown_message<plot::CsvError>([&] { evaluate_table(evaluator, folder / "in.csv", folder / name); }),
        "not a regular file");
  EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
}

TEST_F(WallTable, ATableMayBeReplacedByItsResult) {
  folder.write("in.csv", "position_m\n-0.001\n");
  EXPECT_EQ(evaluate_table(evaluator, folder / "in.csv", folder / "in.csv"), 1u);
  EXPECT_EQ(folder.read("in.csv"), header + "-0.001,0,1\n");
}

// The output has every bit of the numbers, so it agrees with single evaluations exactly.
RC_GTEST_PROP(WallTableProperty, RowsAreTheSingleEvaluations,
              (const std::vector<std::pair<int, int>>& points)) {
  TemporaryFolder folder;
  firmware::ParameterValues values;
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  const WallEvaluator evaluator(values);
  std::string text = "position_m,velocity_m_per_s\n";
  for (const auto& [x, v] : points) text += fmt::format("{},{}\n", x / 7.0, v / 3.0);
  RC_ASSERT(evaluate_table(evaluator, folder.write("in.csv", text), folder / "out.csv") == points.size());
  if (points.empty()) return;
  const plot::CsvTable out = plot::read_csv(folder / "out.csv");
  RC_ASSERT(out.columns[0].size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = points[i].first / 7.0, v = points[i].second / 3.0;
    RC_ASSERT(out.columns[0][i] == x && out.columns[1][i] == v);
    RC_ASSERT(out.column("force_n")[i] == evaluator.at(x, v).force);
  }
}

}  // namespace kmax::wall::wall_table_test
