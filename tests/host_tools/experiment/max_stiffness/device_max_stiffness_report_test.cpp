#include "host_tools/experiment/max_stiffness/device_max_stiffness_report.hpp"

#include <gtest/gtest.h>

#include "host_tools/plot/figure.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::device_max_stiffness_report_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;
using simulation::ContactVerdict;

DeviceStiffnessResult result_of(const std::string& name, double stiffness) {
  DeviceStiffnessResult result;
  result.condition.name = name;
  result.found.stiffness = stiffness;
  result.found.touches = 2;
  result.found.saturated_share = 0.0125;
  result.touches = {{stiffness, 1, ContactVerdict::stable, 0.05e-3, 0.0125, false, 0},
                    {stiffness + 100, 1, ContactVerdict::unstable, 6e-3, 0.2, true, 3}};
  return result;
}

TEST(DeviceStiffnessReport, TheTableHasThePapersValueBesideOursAndItsOrigin) {
  DeviceStiffnessResult plain = result_of("plain", 3500), none = result_of("none", 0),
                        beyond = result_of("beyond", 20e3), left = result_of("left", 4000);
  plain.condition.paper = 3580;
  beyond.found.beyond_last = true;
  left.found.never_touched = true;
  const report::Table table = device_stiffness_table({plain, none, beyond, left});
  EXPECT_CONTAINS(table.columns[1], "measured");
  EXPECT_CONTAINS(table.columns[2], "paper");
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"plain", "3.50", "3.58", "2", "1.2 %",
                                                     "touches ended by the host: 1"}));
  EXPECT_EQ(table.rows[1][1], "none stable");
  EXPECT_EQ(table.rows[1][2], "-");
  EXPECT_EQ(table.rows[2][1], ">= 20.00");
  EXPECT_CONTAINS(table.rows[3][5], "the wall was not held");
  EXPECT_TRUE(device_stiffness_table({}).rows.empty());
}

TEST(DeviceStiffnessReport, EveryTouchIsARow) {
  const report::Table table = device_touch_table({result_of("a", 3500), result_of("b", 4000)});
  ASSERT_EQ(table.rows.size(), 4u);
  EXPECT_EQ(table.rows[1],
            (std::vector<std::string>{"a", "3600", "1", "unstable", "0.006", "0.2", "yes", "3"}));
}

TEST(DeviceStiffnessReport, ThePageAndItsFilesAreWritten) {
  const TemporaryFolder folder;
  const auto files =
      write_device_stiffness({result_of("a | b", 3500)}, {}, {}, "serial:/dev/x", folder / "out", ".svg");
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(files.size(), 5u);
  EXPECT_CONTAINS(folder.read("out/max_stiffness.md"), "| a \\| b | 3.50 |");
  EXPECT_CONTAINS(folder.read("out/max_stiffness.html"), "serial:/dev/x");
  EXPECT_CONTAINS(folder.read("out/max_stiffness.html"), "src=\"max_stiffness.svg\"");
  EXPECT_NE(thrown_message<plot::FigureError>(
                [&] { write_device_stiffness({result_of("a", 3500)}, {}, {}, "x", folder / "gif", ".gif"); }),
            "");
  // What was measured is there all the same.
  for (const char* name : {"max_stiffness.csv", "max_stiffness_touches.csv", "max_stiffness.html"})
    EXPECT_TRUE(std::filesystem::exists(folder / "gif" / name)) << name;
}

TEST(DeviceStiffnessReport, WithoutATouchThereIsNoPicture) {
  const TemporaryFolder folder;
  DeviceStiffnessResult untouched = result_of("a", 0);
  untouched.touches.clear();
  EXPECT_EQ(write_device_stiffness({untouched}, {}, {}, "x", folder / "out", ".svg").size(), 4u);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/max_stiffness.svg"));
  EXPECT_EQ(folder.read("out/max_stiffness.html").find("<img"), std::string::npos);
  EXPECT_EQ(
      write_device_stiffness({untouched, result_of("b", 1)}, {}, {}, "x", folder / "out", ".svg").size(), 5u);
}

}  // namespace kmax::experiment::device_max_stiffness_report_test
