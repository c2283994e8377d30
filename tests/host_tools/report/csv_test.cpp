#include "host_tools/report/csv.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kmax::report::csv_test {
namespace {

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

}  // namespace
}  // namespace kmax::report::csv_test
