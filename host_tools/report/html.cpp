
#include <string_view>

#include "host_tools/report/page.hpp"

namespace kmax::report {

namespace {
constexpr std::string_view head = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light">
<title>)";

constexpr std::string_view style = R"(</title>
<style>
body { margin: 2rem auto; padding: 0 1rem; max-width: 60rem; background: #ffffff; color: #1b1b1b;
       font: 1rem/1.5 system-ui, "Liberation Sans", "DejaVu Sans", sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.25; }
h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid #b0b0b0; }
div.table { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: bold; padding: 0.25rem 0; }
th, td { text-align: left; vertical-align: top; padding: 0.2rem 0.75rem 0.2rem 0; border-bottom: 1px solid #d8d8d8; }
th { border-bottom: 2px solid #1b1b1b; vertical-align: bottom; }
th.number, td.number { text-align: right; white-space: nowrap; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; background: #ffffff; }
figcaption { color: #444444; }
</style>
</head>
<body>
)";

/// A line's end in a text is shown as one.
std::string shown(const std::string& text) {
  std::string lines;
  std::size_t begin = 0;
  for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', begin)) {
    const std::size_t length = end > begin && text[end - 1] == '\r' ? end - begin - 1 : end - begin;
    lines += html_escaped(text.substr(begin, length)) + "<br>";
    begin = end + 1;
  }
  return lines + html_escaped(text.substr(begin));
}

void add_html_table(std::string& text, const Table& table) {
  const std::vector<bool> number = number_columns(table);
  if (table.columns.empty()) {
    if (!table.caption.empty()) text += "<p>" + shown(table.caption) + "</p>\n";
    return;
  }
  text += "<div class=\"table\">\n<table>\n";
  if (!table.caption.empty()) text += "<caption>" + shown(table.caption) + "</caption>\n";
  const auto add_row = [&](const std::vector<std::string>& cells, const char* element,
                           const char* attributes) {
    text += "<tr>";
    for (std::size_t i = 0; i < cells.size(); ++i) {
      text += std::string("<") + element + attributes + (number[i] ? " class=\"number\">" : ">");
      text += shown(cells[i]) + "</" + element + ">";
    }
    text += "</tr>\n";
  };
  text += "<thead>\n";
  add_row(table.columns, "th", " scope=\"col\"");
  text += "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) add_row(row, "td", "");
  text += "</tbody>\n</table>\n</div>\n";
}
}  // namespace

std::string html_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? ' ' : c;
    }
  }
  return escaped;
}

std::string html(const Page& page) {
  std::string text = std::string(head) + html_escaped(page.title) + std::string(style);
  text += "<h1>" + html_escaped(page.title) + "</h1>\n";
  for (const Section& section : page.sections) {
    text += "<section>\n";
    if (!section.heading.empty()) text += "<h2>" + html_escaped(section.heading) + "</h2>\n";
    for (const std::string& paragraph : section.paragraphs) text += "<p>" + shown(paragraph) + "</p>\n";
    for (const Table& table : section.tables) add_html_table(text, table);
    for (const Picture& picture : section.pictures) {
      const std::string caption = html_escaped(picture.caption);
      text += "<figure>\n<img src=\"" + url_path(picture.file) + "\" alt=\"" + caption + "\">\n";
      if (!caption.empty()) text += "<figcaption>" + caption + "</figcaption>\n";
      text += "</figure>\n";
    }
    text += "</section>\n";
  }
  return text + "</body>\n</html>\n";
}

}  // namespace kmax::report
