
#include <cctype>

#include "host_tools/report/page.hpp"

namespace kmax::report {

namespace {
bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || (static_cast<unsigned char>(c) & 0x80) != 0;
}

/// What would begin a heading, a list, a quotation or a rule at the beginning of a line.
std::string as_paragraph(const std::string& text) {
  std::string escaped = markdown_escaped(text);
  const std::size_t first = escaped.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  escaped.erase(0, first);
  if (std::string_view("#+-=").find(escaped[0]) != std::string_view::npos) return "\\" + escaped;
  std::size_t digits = 0;
  while (digits < escaped.size() && std::isdigit(static_cast<unsigned char>(escaped[digits])) != 0) ++digits;
  if (digits > 0 && digits < escaped.size() && (escaped[digits] == '.' || escaped[digits] == ')') &&
      (digits + 1 == escaped.size() || escaped[digits + 1] == ' '))
    escaped.insert(digits, "\\");
  return escaped;
}

void add_markdown_table(std::string& text, const Table& table) {
  const std::vector<bool> right = number_columns(table);
  if (!table.caption.empty()) text += as_paragraph(table.caption) + "\n\n";
  if (table.columns.empty()) return;
  const auto add_row = [&](const std::vector<std::string>& cells) {
    text += '|';
    for (const std::string& cell : cells) text += ' ' + markdown_escaped(cell) + (cell.empty() ? "|" : " |");
    text += '\n';
  };
  add_row(table.columns);
  text += '|';
  for (const bool number : right) text += number ? "---:|" : "---|";
  text += '\n';
  for (const auto& row : table.rows) add_row(row);
  text += '\n';
}
}  // namespace

std::string markdown_escaped(const std::string& text) {
  std::string escaped;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
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
      case '\r':
        if (i + 1 < text.size() && text[i + 1] == '\n') break;
        [[fallthrough]];
      case '\n':
        escaped += "<br>";
        break;
      case '\\':
      case '`':
      case '*':
      case '[':
      case ']':
      case '|':
      case '~':
      case '$':
        escaped += '\\';
        escaped += c;
        break;
      case '_': {
        // Within a word, as in F_MC, it is no emphasis.
        const bool within = i > 0 && is_word(text[i - 1]) && i + 1 < text.size() && is_word(text[i + 1]);
        escaped += within ? "_" : "\\_";
        break;
      }
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

std::string markdown(const Page& page) {
  std::string text = "# " + markdown_escaped(page.title) + "\n\n";
  for (const Section& section : page.sections) {
    if (!section.heading.empty()) text += "## " + markdown_escaped(section.heading) + "\n\n";
    for (const std::string& paragraph : section.paragraphs) {
      const std::string written = as_paragraph(paragraph);
      if (!written.empty()) text += written + "\n\n";
    }
    for (const Table& table : section.tables) add_markdown_table(text, table);
    for (const Picture& picture : section.pictures)
      text += "![" + markdown_escaped(picture.caption) + "](" + url_path(picture.file) + ")\n\n";
  }
  while (text.ends_with("\n\n")) text.pop_back();
  return text;
}

}  // namespace kmax::report
