#include "host_tools/report/page.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::report::html_test {

TEST(Html, HasEverythingInItsOrder) {
  const Page page{"Report",
                  {{"First",
                    {"One."},
                    {{"Numbers", {"wall", "K"}, {{"plain", "3.58"}}}},
                    {{"A curve", "results/curve 1.svg"}}}}};
  const std::string text = html(page);
  EXPECT_TRUE(text.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"));
  EXPECT_TRUE(text.ends_with("</body>\n</html>\n"));
  std::size_t at = 0;
  for (const char* part :
       {"<meta charset=\"utf-8\">", "<title>Report</title>", "<h1>Report</h1>", "<h2>First</h2>",
        "<p>One.</p>", "<caption>Numbers</caption>",
        "<th scope=\"col\">wall</th><th scope=\"col\" class=\"number\">K</th>",
        "<td>plain</td><td class=\"number\">3.58</td>", "<img src=\"curve%201.svg\" alt=\"A curve\">",
        "<figcaption>A curve</figcaption>"}) {
    const std::size_t found = text.find(part, at);
    ASSERT_NE(found, std::string::npos) << part << "\n" << text;
    at = found;
  }
}

TEST(Html, NeedsNothingFromElsewhere) {
  const std::string text = html({"t", {{"h", {"p"}, {{"c", {"a"}, {{"b"}}}}, {{"d", "e.svg"}}}}});
  for (const char* foreign : {"<script", "http", "@import", "<link", "url("})
    EXPECT_EQ(text.find(foreign), std::string::npos) << foreign;
}

TEST(Html, NothingOfATextBecomesMarkup) {
  const std::string evil = "</td></title><script>alert(\"1\" & '2')</script>";
  const std::string text =
      html({evil, {{evil, {evil}, {{evil, {evil}, {{evil}}}}, {{evil, "a\"><script>.svg"}}}}});
  EXPECT_EQ(text.find("<script"), std::string::npos);
  EXPECT_EQ(text.find("alert(\"1\""), std::string::npos);
  EXPECT_CONTAINS(text,
                  "alt=\"&lt;/td&gt;&lt;/title&gt;&lt;script&gt;alert(&quot;1&quot; &amp; &#39;2&#39;)");
  EXPECT_CONTAINS(text, "src=\"a%22%3E%3Cscript%3E.svg\"");
}

TEST(HtmlEscaped, SpecialCharactersControlsAndTheRest) {
  EXPECT_EQ(html_escaped("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
  EXPECT_EQ(html_escaped(std::string("a\0b\x1B\n\x7F", 6)), "a b   ");
  EXPECT_EQ(html_escaped("µ 力覚 |"), "µ 力覚 |");
}

TEST(Html, LineEndsAreShown) {
  const std::string text = html({"t", {{"", {"a\nb\r\nc\n"}, {{"", {"x"}, {{"1\n2"}}}}, {}}}});
  EXPECT_CONTAINS(text, "<p>a<br>b<br>c<br></p>");
  EXPECT_CONTAINS(text, "<td>1<br>2</td>");
}

TEST(Html, EmptyTablesAndPagesAreWellFormed) {
  EXPECT_EQ(html({}).find("<table"), std::string::npos);
  EXPECT_CONTAINS(html({"t", {{"", {}, {{"c", {}, {}}}, {}}}}), "<p>c</p>");
  const std::string text = html({"t", {{"", {}, {{"", {"a"}, {}}}, {}}}});
  EXPECT_CONTAINS(text, "<tbody>\n</tbody>");
  EXPECT_EQ(text.find("<caption>"), std::string::npos);
}

RC_GTEST_PROP(HtmlProperty, TagsAreThoseOfTheEmptyPageWhateverTheTexts,
              (const std::string& a, const std::string& b)) {
  const auto tags = [](const std::string& cell, const std::string& text) {
    const std::string page = html({text, {{text, {text}, {{text, {"x"}, {{cell}}}}, {{text, cell}}}}});
    return std::count(page.begin(), page.end(), '<');
  };
  const auto without = [](std::string text) {
    std::erase_if(text, [](char c) { return c == '\n' || c == '\r'; });
    return "." + text;
  };
  RC_ASSERT(tags(without(a), without(b)) == tags("x", "y"));
}

}  // namespace kmax::report::html_test
