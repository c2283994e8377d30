#include "host_tools/report/page.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::report::markdown_test {

TEST(Markdown, HasEverythingInItsOrder) {
  const Page page{"Report",
                  {{"First",
                    {"One.", "Two."},
                    {{"Numbers", {"wall", "K"}, {{"plain", "3.58"}}}},
                    {{"A curve", "results/curve 1.svg"}}},
                   {"Second", {}, {}, {}}}};
  EXPECT_EQ(markdown(page),
            "# Report\n\n## First\n\nOne.\n\nTwo.\n\nNumbers\n\n"
            "| wall | K |\n|---|---:|\n| plain | 3.58 |\n\n"
            "![A curve](curve%201.svg)\n\n## Second\n");
}

TEST(Markdown, ACellCannotEndItself) {
  const std::string text =
      markdown({"t", {{"", {}, {{"", {"a|b", "c"}, {{"x | y", "l1\nl2"}, {"\\", ""}}}}, {}}}});
  EXPECT_CONTAINS(text, "| a\\|b | c |\n");
  EXPECT_CONTAINS(text, "| x \\| y | l1<br>l2 |\n");
  EXPECT_CONTAINS(text, "| \\\\ | |\n");
}

TEST(MarkdownEscaped, WhatMeansSomething) {
  EXPECT_EQ(markdown_escaped("<script> & </script>"), "&lt;script&gt; &amp; &lt;/script&gt;");
  EXPECT_EQ(markdown_escaped("*a* `b` [c](d) ~e~ $f$"), "\\*a\\* \\`b\\` \\[c\\](d) \\~e\\~ \\$f\\$");
  EXPECT_EQ(markdown_escaped("F_MC = 2 N, _x_, b_"), "F_MC = 2 N, \\_x\\_, b\\_");
  EXPECT_EQ(markdown_escaped("a\r\nb\rc\nd"), "a<br>b<br>c<br>d");
  EXPECT_EQ(markdown_escaped("µ γ \" '"), "µ γ \" '");
  EXPECT_EQ(markdown_escaped("\x1B["), " \\[");
}

TEST(Markdown, AParagraphIsNoHeadingListOrRule) {
  const auto paragraph = [](const std::string& text) {
    const std::string page = markdown({"t", {{"", {text}, {}, {}}}});
    return page.substr(5, page.size() - 6);
  };
  EXPECT_EQ(paragraph("# no"), "\\# no");
  EXPECT_EQ(paragraph("- no"), "\\- no");
  EXPECT_EQ(paragraph("+ no"), "\\+ no");
  EXPECT_EQ(paragraph("> no"), "&gt; no");
  EXPECT_EQ(paragraph("---"), "\\---");
  EXPECT_EQ(paragraph("12. no"), "12\\. no");
  EXPECT_EQ(paragraph("3) no"), "3\\) no");
  EXPECT_EQ(paragraph("3.58 N/mm"), "3.58 N/mm");
  EXPECT_EQ(paragraph("    no code"), "no code");
  EXPECT_EQ(markdown({"t", {{"", {"", "  "}, {}, {}}}}), "# t\n");
}

TEST(Markdown, EmptyTables) {
  EXPECT_EQ(markdown({"t", {{"", {}, {{"c", {}, {}}}, {}}}}), "# t\n\nc\n");
  EXPECT_EQ(markdown({"t", {{"", {}, {{"", {}, {}}}, {}}}}), "# t\n");
  EXPECT_EQ(markdown({"t", {{"", {}, {{"", {"a"}, {}}}, {}}}}), "# t\n\n| a |\n|---|\n");
}

RC_GTEST_PROP(MarkdownProperty, ARowIsALineWithAsManyBarsWhateverIsInIt,
              (const std::string& a, const std::string& b)) {
  const std::string text = markdown({"t", {{"", {}, {{"", {"x", "y"}, {{a, b}}}}, {}}}});
  const std::string row = text.substr(text.find("\n", text.find("|---")) + 1);
  std::size_t bars = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (row[i] == '\\') {
      ++i;
    } else {
      bars += row[i] == '|' ? 1 : 0;
    }
  }
  RC_ASSERT(bars == 3u);
  RC_ASSERT(std::count(row.begin(), row.end(), '\n') == 1);
}

}  // namespace kmax::report::markdown_test
