#include "host_tools/experiment/contact/contact_report.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "host_tools/plot/csv_table.hpp"
#include "host_tools/plot/figure.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::contact_report_test {
namespace {
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

ContactResult result_of(const std::string& name) {
  ContactResult result;
  result.condition = {name, "9", {}, "stable", true, {}};
  result.measure.verdict = simulation::ContactVerdict::stable;
  result.measure.peak_to_peak = 0.1234e-3;
  result.judged_to = 1.0;
  result.trials = 3;
  for (int i = 0; i < 100; ++i)
    result.samples.push_back({i * 0.01 - 0.1, 1e-3 - i * 2e-5, 0.5 * i, 0.0, 0.0, 1.0});
  return result;
}

TEST(ContactReport, TableHasALineForEachConditionUnderItsHeadings) {
  const std::string table = contact_table({result_of("first"), result_of("second")});
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  for (const char* text : {"first", "second", "0.123 mm", "0 of 3", "Fig. 9", "yes"})
    EXPECT_CONTAINS(table, text);
  const auto column = table.find("verdict");
  EXPECT_EQ(table.substr(table.find("first") + column, 6), "stable") << table;
  const std::string empty = contact_table({});
  EXPECT_EQ(std::count(empty.begin(), empty.end(), '\n'), 1);
}

TEST(ContactReport, PictureAndTableShareASafeName) {
  const TemporaryFolder folder;
  const ContactResult result = result_of("F_MC = 2 N, ../x");
  const auto files = write_contact(result, folder / "new/folder", ".svg");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0], folder / "new/folder/contact_f_mc_2_n_x.svg");
  EXPECT_EQ(files[1], folder / "new/folder/contact_f_mc_2_n_x.csv");
  const plot::CsvTable csv = plot::read_csv(files[1]);
  ASSERT_EQ(csv.column("time_s").size(), result.samples.size());
  for (std::size_t i = 0; i < result.samples.size(); ++i) {
    ASSERT_EQ(csv.column("position_m")[i], result.position(result.samples[i]));
    ASSERT_EQ(csv.column("force_n")[i], result.samples[i].force);
  }
  EXPECT_CONTAINS(folder.read("new/folder/contact_f_mc_2_n_x.svg"), "0.12 mm peak to peak");
}

TEST(ContactReport, WhatCannotBeWrittenIsAnError) {
  const TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { write_contact(result_of("a"), folder / "file", ".svg"); }),
      "file");
  std::filesystem::create_directories(folder / "out/contact_a.csv");
  EXPECT_CONTAINS(
      thrown_message<std::runtime_error>([&] { write_contact(result_of("a"), folder / "out", ".svg"); }),
      "contact_a.csv: cannot be written");
  EXPECT_CONTAINS(
      thrown_message<plot::FigureError>([&] { write_contact(result_of("b"), folder / "out", ".gif"); }),
      "must end in");
}

}  // namespace
}  // namespace kmax::experiment::contact_report_test
