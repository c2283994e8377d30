#include "host_tools/report/column_alignment.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kmax::report::column_alignment_test {
namespace {

TEST(ReadsAsNumber, WithSignPointExponentAndUnit) {
  for (const char* text : {"0", "-3.58", "+2", ".5", "5.", "1e-3", "1E+6", "17.4 %", "0.165 mm", "9.1 N s/m",
                           ">= 20", "< 0.1", "3580 N/m", "3.58 (0.41)"})
    EXPECT_TRUE(reads_as_number(text)) << text;
}

TEST(ReadsAsNumber, NotRangesShareWordsAndNames) {
  for (const char* text :
       {"", "-", ".", "e5", "3 of 12", "0.1 to 0.4", "1.2..1.5", "2026-11-21", "12:30", "F_MC = 0 N", "0x10",
        "3 -4", "5 (estimated)", "1 2", "stable", "nan", "5 touches each time", "1,5", "3N"})
    EXPECT_FALSE(reads_as_number(text)) << text;
}

RC_GTEST_PROP(ReadsAsNumberProperty, EveryNumberThatIsPrintedReadsAsOne, ()) {
  const double number = *rc::gen::map(rc::gen::arbitrary<int>(), [](int n) { return n * 1e-7; });
  RC_ASSERT(reads_as_number(fmt::format("{}", number)));
  RC_ASSERT(reads_as_number(fmt::format("{:.3g} mm", number)));
}

TEST(NumberColumns, EmptyCellsAndMarksDoNotCountAndDoNotMakeOne) {
  const Table table{"",
                    {"numbers", "with marks", "words", "mixed", "marks only"},
                    {{"1", "-", "a", "1", "-"}, {"2 mm", "3", "b", "two", "NA"}, {"-3e4", "", "3", "", ""}}};
  EXPECT_EQ(number_columns(table), (std::vector<bool>{true, true, false, false, false}));
  EXPECT_EQ(number_columns({"", {"a", "b"}, {}}), (std::vector<bool>{false, false}));
  EXPECT_TRUE(number_columns({}).empty());
}

}  // namespace
}  // namespace kmax::report::column_alignment_test
