#include "host_tools/plot/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <sstream>
#include <string_view>
#include <utility>

#include "host_tools/base/files.hpp"

namespace kmax::plot {

namespace {
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t comma = line.find(',', begin);
    std::string field = line.substr(begin, comma == std::string::npos ? comma : comma - begin);
    while (!field.empty() && (field.back() == '\r' || field.back() == ' ')) field.pop_back();
    field.erase(
        0, field.find_first_not_of(' ') == std::string::npos ? field.size() : field.find_first_not_of(' '));
    fields.push_back(std::move(field));
    if (comma == std::string::npos) return fields;
    begin = comma + 1;
  }
}
}  // namespace

CsvTable read_csv(const std::filesystem::path& path) {
  std::istringstream file(base::text_of<CsvError>(path, "give the path of a table (CSV)"));
  CsvTable table;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line == "\r" || line.front() == '#') continue;
    const std::vector<std::string> fields = fields_of(line);
    if (table.names.empty()) {
      table.names = fields;
      table.columns.resize(fields.size());
      continue;
    }
    if (fields.size() != table.names.size())
      throw CsvError(fmt::format("{}:{}: {} fields where the first line names {} columns", path.string(),
                                 number, fields.size(), table.names.size()));
    for (std::size_t i = 0; i < fields.size(); ++i) {
      double value = 0;
      const char* const end = fields[i].data() + fields[i].size();
      const auto result = std::from_chars(fields[i].data(), end, value);
      const bool whole = result.ec == std::errc{} && result.ptr == end;
      table.columns[i].push_back(whole ? value : std::numeric_limits<double>::quiet_NaN());
    }
  }
  if (file.bad()) throw CsvError(fmt::format("{}: reading failed; is it a folder?", path.string()));
  if (table.names.empty()) throw CsvError(fmt::format("{}: the file is empty", path.string()));
  if (table.columns[0].empty())
    throw CsvError(fmt::format("{}: there are no rows below the column names", path.string()));
  return table;
}

const std::vector<double>& CsvTable::column(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return columns[static_cast<std::size_t>(found - names.begin())];
  throw CsvError(fmt::format("there is no column '{}'; the columns are {}", name, fmt::join(names, ", ")));
}

std::string label_of(const std::string& column) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 11> units = {
      {{"_m_per_s", "m/s"},
       {"_n_per_m", "N/m"},
       {"_counts", "counts"},
       {"_hz", "Hz"},
       {"_rad", "rad"},
       {"_mm", "mm"},
       {"_m", "m"},
       {"_n", "N"},
       {"_s", "s"},
       {"_a", "A"},
       {"_v", "V"}}};
  for (const auto& [ending, unit] : units) {
    if (!column.ends_with(ending) || column.size() == ending.size()) continue;
    std::string words = column.substr(0, column.size() - ending.size());
    std::replace(words.begin(), words.end(), '_', ' ');
    return fmt::format("{} ({})", words, unit);
  }
  std::string words = column;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace kmax::plot
