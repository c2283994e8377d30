#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <sstream>

#include "host_tools/base/terminal_text.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::report::terminal_text_test {
namespace {

TEST(TerminalText, NumbersStandRightAndWordsLeft) {
  const Table table{"Largest stiffness",
                    {"wall", "K_max (N/mm)", "paper"},
                    {{"plain", "3.58", "-"}, {"2 N field", "8.4", "8.41"}}};
  EXPECT_EQ(terminal_text(table),
            "Largest stiffness\n"
            "wall       K_max (N/mm)  paper\n"
            "---------  ------------  -----\n"
            "plain              3.58      -\n"
            "2 N field           8.4   8.41\n");
}

TEST(TerminalText, LinesHaveNoSpaceAtTheirEnd) {
  EXPECT_EQ(terminal_text({"", {"a", "long heading"}, {{"x", "y"}, {"z", ""}}}),
            "a  long heading\n-  ------------\nx  y\nz\n");
}

TEST(TerminalText, EmptyTables) {
  EXPECT_EQ(terminal_text({}), "");
  EXPECT_EQ(terminal_text({"caption", {}, {}}), "caption\n");
  EXPECT_EQ(terminal_text({"", {"a", "b"}, {}}), "a  b\n-  -\n");
  EXPECT_EQ(terminal_text({"", {""}, {{""}}}), "\n\n\n");
}

TEST(TerminalText, ALinesEndOrAnEscapeSequenceInACellCannotBreakTheTable) {
  const std::string text = terminal_text({"cap\ntion",
                                          {"a\tb"},
                                          {{"x\r\ny"},
                                           {"\x1B[31mred"},
                                           {"\xC2\x9B"
                                            "0m"}}});
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6);
  for (const char* control : {"\r", "\t", "\x1B", "\xC2\x9B"})
    EXPECT_EQ(text.find(control), std::string::npos);
}

RC_GTEST_PROP(TerminalTextProperty, ColumnsBeginWhereTheirHeadingsDo, ()) {
  const auto cells = *rc::gen::container<std::vector<std::string>>(
      rc::gen::container<std::string>(rc::gen::inRange('a', 'f')));
  Table table{"", {"first", "second"}, {}};
  for (const std::string& cell : cells) table.rows.push_back({"µ" + cell, "|"});
  std::istringstream lines(terminal_text(table));
  std::string line;
  std::getline(lines, line);
  const std::size_t second = line.find("second");
  std::getline(lines, line);
  while (std::getline(lines, line)) RC_ASSERT(base::display_width(line.substr(0, line.find('|'))) == second);
}

RC_GTEST_PROP(TerminalTextProperty, AnyBytesGiveALinePerRow, (const std::vector<std::string>& cells)) {
  Table table{"", {"heading"}, {}};
  for (const std::string& cell : cells) table.rows.push_back({cell});
  const std::string text = terminal_text(table);
  RC_ASSERT(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) == cells.size() + 2);
}

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

TEST(TerminalText, FitsIntoAWidthBetweenWords) {
  const Table table{"What it is about",
                    {"hand", "peak to peak (mm)", "what the paper says"},
                    {{"subject 1", "1.595", "a large sustained oscillation"}, {"2", "0", "stable"}}};
  EXPECT_EQ(terminal_text(table, 40),
            "What it is about\n"
            "            peak to peak  what the paper\n"
            "hand                (mm)  says\n"
            "---------  -------------  --------------\n"
            "subject 1          1.595  a large\n"
            "                          sustained\n"
            "                          oscillation\n"
            "2                      0  stable\n");
  EXPECT_EQ(terminal_text(table, 1000), terminal_text(table));
  // No word is cut, whatever is asked.
  EXPECT_NE(terminal_text(table, 1).find("oscillation"), std::string::npos);
  EXPECT_NE(terminal_text(table, 1).find("1.595"), std::string::npos);
}

}  // namespace kmax::report::terminal_text_test
