#include "host_tools/report/page_files.hpp"

#include <gtest/gtest.h>

#include "host_tools/plot/csv_table.hpp"
#include "host_tools/report/html.hpp"
#include "host_tools/report/markdown.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::report::page_files_test {
namespace {
using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

TEST(PageFiles, BothFormsAreWrittenIntoAFolderThatIsMade) {
  const TemporaryFolder folder;
  const Page page{"t", {{"h", {"p"}, {}, {}}}};
  const auto files = write_page(page, folder / "a/b", "result");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0], folder / "a/b/result.md");
  EXPECT_EQ(files[1], folder / "a/b/result.html");
  EXPECT_EQ(folder.read("a/b/result.md"), markdown(page));
  EXPECT_EQ(folder.read("a/b/result.html"), html(page));
  write_page({"other", {}}, folder / "a/b", "result");
  EXPECT_EQ(folder.read("a/b/result.md"), "# other\n");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "a/b"), {}), 2);
}

TEST(PageFiles, ATableIsReadBackByTheProgramsOwnReader) {
  const TemporaryFolder folder;
  write_csv({"", {"time_s", "force_n"}, {{"0", "1.5"}, {"0.002", "-2"}}}, folder / "t.csv");
  const plot::CsvTable table = plot::read_csv(folder / "t.csv");
  EXPECT_EQ(table.column("time_s"), (std::vector<double>{0, 0.002}));
  EXPECT_EQ(table.column("force_n"), (std::vector<double>{1.5, -2}));
}

TEST(PageFiles, WhatCannotBeWrittenIsNamedAndLeavesNothing) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "out/page.md/inside");
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] {
                    write_page({"t", {}}, folder / "out", "page");
                  }),
                  "out/page.md: cannot be written");
  EXPECT_FALSE(std::filesystem::exists(folder / "out/page.md.part"));
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] { write_csv({}, folder / "none/t.csv"); }),
                  "none/t.csv: cannot be written");
  folder.write("file", "");
  EXPECT_CONTAINS(thrown_message<std::runtime_error>([&] {
                    write_page({"t", {}}, folder / "file/x", "page");
                  }),
                  "file");
}

}  // namespace
}  // namespace kmax::report::page_files_test
