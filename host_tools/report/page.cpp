#include "host_tools/report/page.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "host_tools/base/files.hpp"

namespace kmax::report {

std::string_view to_string(Origin origin) {
  switch (origin) {
    case Origin::calibrated:
      return "calibrated";
    case Origin::predicted:
      return "predicted";
    case Origin::measured:
      return "measured";
    case Origin::paper:
      return "paper";
  }
  return "";
}

void require_rectangular(const Table& table) {
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (table.rows[i].size() == table.columns.size()) continue;
    throw std::invalid_argument(fmt::format("table '{}', row {}: has {} cells for {} columns", table.caption,
                                            i + 1, table.rows[i].size(), table.columns.size()));
  }
}

std::string url_path(const std::filesystem::path& file) {
  constexpr std::string_view unreserved =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  std::string written;
  for (const char c : file.filename().string()) {
    if (unreserved.find(c) != std::string_view::npos) {
      written += c;
    } else {
      written += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return written;
}

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

std::vector<std::filesystem::path> write_page(const Page& page, const std::filesystem::path& folder,
                                              const std::string& name) {
  const std::string as_markdown = markdown(page), as_html = html(page);
  base::make_folder(folder);
  const std::vector<std::filesystem::path> files = {folder / (name + ".md"), folder / (name + ".html")};
  base::write_file(files[0], as_markdown);
  base::write_file(files[1], as_html);
  return files;
}

void write_csv(const Table& table, const std::filesystem::path& file) {
  base::write_file(file, csv(table));
}

}  // namespace kmax::report
