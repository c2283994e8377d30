#include "host_tools/report/page.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "host_tools/plot/csv_table.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::report::page_test {
namespace {
using host_tools_test::thrown_message;

TEST(Page, OriginsHaveTheWordsOfTheReports) {
  EXPECT_EQ(to_string(Origin::calibrated), "calibrated");
  EXPECT_EQ(to_string(Origin::predicted), "predicted");
  EXPECT_EQ(to_string(Origin::measured), "measured");
  EXPECT_EQ(to_string(Origin::paper), "paper");
}

TEST(Page, ARowThatDoesNotFitIsRefusedByEveryWriter) {
  for (const std::vector<std::string>& row : {std::vector<std::string>{"1"}, {"1", "2", "3"}, {}}) {
    const Table table{"K_max", {"a", "b"}, {{"1", "2"}, row}};
    const auto what = [&](auto call) { return thrown_message<std::invalid_argument>(call); };
    EXPECT_CONTAINS(what([&] { csv(table); }), "'K_max', row 2");
    EXPECT_NE(what([&] { terminal_text(table); }), "");
    EXPECT_NE(what([&] { markdown({"t", {{"s", {}, {table}, {}}}}); }), "");
    EXPECT_NE(what([&] { html({"t", {{"s", {}, {table}, {}}}}); }), "");
  }
}

TEST(UrlPath, IsTheNameAloneWithoutAnythingThatMeansSomething) {
  EXPECT_EQ(url_path("contact_f_mc_2_n.svg"), "contact_f_mc_2_n.svg");
  EXPECT_EQ(url_path("/home/a/results/x.svg"), "x.svg");
  EXPECT_EQ(url_path("results/a b(1)#?%.svg"), "a%20b%281%29%23%3F%25.svg");
  EXPECT_EQ(url_path("µ.svg"), "%C2%B5.svg");
  EXPECT_EQ(url_path("javascript:alert(1)"), "javascript%3Aalert%281%29");
  EXPECT_EQ(url_path(""), "");
}

TEST(Csv, FieldsAreQuotedWhereRfc4180AsksForIt) {
  EXPECT_EQ(
      csv({"caption", {"a", "b"}, {{"1", "x,y"}, {"say \"no\"", "l1\nl2"}, {" s ", "\r"}, {"", "|<µ"}}}),
      "a,b\r\n1,\"x,y\"\r\n\"say \"\"no\"\"\",\"l1\nl2\"\r\n s ,\"\r\"\r\n,|<µ\r\n");
}

TEST(Csv, EmptyTables) {
  EXPECT_EQ(csv({}), "");
  EXPECT_EQ(csv({"", {"a"}, {}}), "a\r\n");
  EXPECT_EQ(csv({"", {"a"}, {{""}}}), "a\r\n\"\"\r\n");
}

/// A reader that knows RFC 4180 and nothing else.
std::vector<std::vector<std::string>> parsed(const std::string& text) {
  std::vector<std::vector<std::string>> records{{""}};
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    std::string& field = records.back().back();
    if (quoted) {
      if (c != '"') {
        field += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        field += text[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      records.back().emplace_back();
    } else if (c == '\r' && text[i + 1] == '\n') {
      records.push_back({""});
      ++i;
    } else {
      field += c;
    }
  }
  records.pop_back();
  return records;
}

RC_GTEST_PROP(CsvProperty, ComesBackFromAnyBytes, ()) {
  const auto columns = *rc::gen::inRange<std::size_t>(1, 4);
  // Characters that mean something are rare among arbitrary ones.
  const auto text = rc::gen::container<std::string>(
      rc::gen::oneOf(rc::gen::elementOf(std::string(",\"\r\n|")), rc::gen::arbitrary<char>()));
  const auto row = rc::gen::container<std::vector<std::string>>(columns, text);
  Table table{"", *row, *rc::gen::container<std::vector<std::vector<std::string>>>(row)};
  std::vector<std::vector<std::string>> wanted = table.rows;
  wanted.insert(wanted.begin(), table.columns);
  RC_ASSERT(parsed(csv(table)) == wanted);
}

using host_tools_test::TemporaryFolder;

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

}  // namespace kmax::report::page_test
