#include "host_tools/report/csv.hpp"

namespace kmax::report {

namespace {
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

void add_record(std::string& text, const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text += ',';
    // A record of one empty field would be an empty line, which readers pass over.
    text += cells.size() == 1 && cells[i].empty() ? "\"\"" : field(cells[i]);
  }
  text += "\r\n";
}
}  // namespace

std::string csv(const Table& table) {
  require_rectangular(table);
  std::string text;
  if (table.columns.empty()) return text;
  add_record(text, table.columns);
  for (const auto& row : table.rows) add_record(text, row);
  return text;
}

}  // namespace kmax::report
