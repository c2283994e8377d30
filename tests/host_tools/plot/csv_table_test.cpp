#include "host_tools/plot/csv_table.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::plot::csv_table_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

CsvTable read(const std::string& text) {
  const TemporaryFolder folder;
  return read_csv(folder.write("t.csv", text));
}
std::string refused(const std::string& text) {
  return thrown_message<CsvError>([&] { read(text); });
}

TEST(CsvTable, LineEndingsCommentsAndSpacesDoNotMatter) {
  for (const char* text : {"a,b\n1,2\n3,-4e-3\n", "a,b\r\n1,2\r\n3,-4e-3\r\n", "a,b\n1,2\n3,-4e-3",
                           "# who\n\n a , b \n1 , 2\n# half\n\r\n 3,-4e-3 \n\n"}) {
    const CsvTable table = read(text);
    EXPECT_EQ(table.names, (std::vector<std::string>{"a", "b"})) << text;
    EXPECT_EQ(table.column("a"), (std::vector<double>{1, 3})) << text;
    EXPECT_EQ(table.column("b"), (std::vector<double>{2, -4e-3})) << text;
  }
}

TEST(CsvTable, WhatIsNoNumberIsAGap) {
  const CsvTable table = read("a,b\n1,\n2,text\n3,\"4\"\n4,1e400\n5,1.5mm\n6,nan\n7,0.5\n");
  ASSERT_EQ(table.column("b").size(), 7u);
  for (std::size_t row = 0; row < 6; ++row) EXPECT_TRUE(std::isnan(table.column("b")[row])) << row;
  EXPECT_EQ(table.column("b")[6], 0.5);
  EXPECT_TRUE(std::isnan(read("a,b\n1,\n").column("b")[0])) << "an empty field at the end of a line";
}

TEST(CsvTable, ErrorsSayWhereAndWhy) {
  EXPECT_CONTAINS(refused(""), "the file is empty");
  EXPECT_CONTAINS(refused("# only this\n"), "the file is empty");
  EXPECT_CONTAINS(refused("a,b\n"), "no rows");
  EXPECT_CONTAINS(refused("a,b\n1,2\n1\n"), "t.csv:3: 1 fields where the first line names 2");
  EXPECT_CONTAINS(refused("a,b\n1,2,\n"), "t.csv:2: 3 fields where");
  EXPECT_CONTAINS(thrown_message<CsvError>([] { read_csv("/no/such/file.csv"); }), "cannot be read");
  const TemporaryFolder folder;
  EXPECT_CONTAINS(thrown_message<CsvError>([&] { read_csv(folder.path()); }), "it is a folder");
  EXPECT_CONTAINS(thrown_message<CsvError>([] { read("a,b\n1,2\n").column("c"); }),
                  "no column 'c'; the columns are a, b");
}

TEST(CsvTable, LabelsHaveTheUnitOfTheName) {
  const std::vector<std::pair<std::string, std::string>> labels = {
      {"force_n", "force (N)"},
      {"true_velocity_m_per_s", "true velocity (m/s)"},
      {"stiffness_n_per_m", "stiffness (N/m)"},
      {"time_s", "time (s)"},
      {"gap_mm", "gap (mm)"},
      {"position_m", "position (m)"},
      {"position_counts", "position (counts)"},
      {"electrical_angle_rad", "electrical angle (rad)"},
      {"haptic_rate", "haptic rate"},
      {"_n", " n"},
      {"n", "n"},
      {"", ""}};
  for (const auto& [column, label] : labels) EXPECT_EQ(label_of(column), label);
}

RC_GTEST_PROP(CsvTableProperty, NumbersComeBackExactly, (const std::vector<double>& numbers)) {
  RC_PRE(!numbers.empty());
  std::string text = "x,i\n";
  for (std::size_t i = 0; i < numbers.size(); ++i) text += fmt::format("{},{}\n", numbers[i], i);
  RC_ASSERT(read(text).column("x") == numbers);
}

// Any bytes at all: a table with columns of one length, or a CsvError.
RC_GTEST_PROP(CsvTableProperty, GarbageIsATableOrACsvError, ()) {
  const auto text = *rc::gen::container<std::string>(
      rc::gen::element('1', '.', ',', '\n', '\r', '#', '"', ' ', '\0', '-', 'e', 'a', '\xff'));
  try {
    const CsvTable table = read(text);
    RC_ASSERT(table.names.size() == table.columns.size());
    RC_ASSERT(!table.columns.empty());
    for (const auto& column : table.columns) RC_ASSERT(column.size() == table.columns[0].size());
  } catch (const CsvError&) {
  }
}

TEST(CsvTable, NumbersToDrawWithAreNumbersOrGaps) {
  const auto numbers = [](const std::string& text) {
    return thrown_message<CsvError>([&] { read(text).numbers("b"); });
  };
  const CsvTable gaps = read("a,b\n1,\n2,nan\nx,3\n");
  EXPECT_EQ(gaps.numbers("b").back(), 3);
  EXPECT_CONTAINS(numbers("a,b\n1,2\n2,abc\n3,4\n"),
                  "t.csv:3: b is 'abc'; a number, nothing, or nan is needed");
  EXPECT_CONTAINS(numbers("a,b\n1,1e400\n"), "t.csv:2: b is '1e400'");
  EXPECT_CONTAINS(numbers("a,b\n1,inf\n"), "b is 'inf'");
  EXPECT_CONTAINS(numbers("b,b\n1,2\n"), "two columns are named b");
}

}  // namespace kmax::plot::csv_table_test
