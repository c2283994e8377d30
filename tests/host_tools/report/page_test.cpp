#include "host_tools/report/page.hpp"

#include <gtest/gtest.h>

#include "host_tools/report/csv.hpp"
#include "host_tools/report/html.hpp"
#include "host_tools/report/markdown.hpp"
#include "host_tools/report/terminal_text.hpp"
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

}  // namespace
}  // namespace kmax::report::page_test
