#include "host_tools/plot/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "host_tools/base/files.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::plot {

namespace {
/// A comma at the end of a line is followed by an empty field.
std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(base::trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// NaN: no number.
double number_of(std::string_view field) {
  if (field.starts_with('+') && !field.starts_with("+-")) field.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  const bool whole = error == std::errc{} && end == field.data() + field.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

/// Which columns are demanded, by their places.
std::vector<bool> demanded_columns(const CsvTable& table, const CsvDemand& demand, const std::string& file,
                                   std::size_t number, std::string_view line) {
  std::vector<bool> demanded(table.names.size());
  const auto mark = [&](const std::string& name) {
    const auto times = std::count(table.names.begin(), table.names.end(), name);
    if (times > 1) throw CsvError(fmt::format("{}:{}: two columns are named {}", file, number, name));
    const auto found = std::find(table.names.begin(), table.names.end(), name);
    if (times > 0) demanded[static_cast<std::size_t>(found - table.names.begin())] = true;
    return times > 0;
  };
  for (const std::string& name : demand.wanted) mark(name);
  for (const std::string& name : demand.needed) {
    if (mark(name)) continue;
    throw CsvError(fmt::format("{}:{}: the first line must name the columns, {}{}{}; it reads '{}'", file,
                               number, fmt::join(demand.needed, ", "),
                               demand.wanted.empty() ? "" : " and if wanted ", fmt::join(demand.wanted, ", "),
                               line));
  }
  return demanded;
}
}  // namespace

CsvTable read_csv(const std::filesystem::path& path, const CsvDemand& demand) {
  const std::string text = base::text_of<CsvError>(path, "give the path of a table (CSV)");
  const std::string file = path.string();
  CsvTable table;
  std::vector<bool> demanded;
  std::string_view rest = text;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    line = base::trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> fields = fields_of(line);
    if (table.names.empty()) {
      table.names.assign(fields.begin(), fields.end());
      table.columns.resize(fields.size());
      table.strange.resize(fields.size());
      demanded = demanded_columns(table, demand, file, number, line);
      continue;
    }
    if (fields.size() != table.names.size())
      throw CsvError(fmt::format("{}:{}: {} fields where the first line names {} columns", file, number,
                                 fields.size(), table.names.size()));
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const double value = number_of(fields[i]);
      if (demanded[i] && !std::isfinite(value))
        throw CsvError(fmt::format("{}:{}: {} is '{}'; a finite number is needed", file, number,
                                   table.names[i], fields[i]));
      if (!std::isfinite(value) && !fields[i].empty() && fields[i] != "nan" && table.strange[i].empty())
        table.strange[i] = fmt::format("{}:{}: {} is '{}'", file, number, table.names[i], fields[i]);
      table.columns[i].push_back(value);
    }
  }
  if (table.names.empty()) throw CsvError(fmt::format("{}: the file is empty", file));
  if (table.columns[0].empty() && demand.needed.empty())
    throw CsvError(fmt::format("{}: there are no rows below the column names", file));
  return table;
}

bool CsvTable::has(const std::string& name) const {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::vector<double>& CsvTable::column(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return columns[static_cast<std::size_t>(found - names.begin())];
  throw CsvError(fmt::format("there is no column '{}'; the columns are {}", name, fmt::join(names, ", ")));
}

const std::vector<double>& CsvTable::numbers(const std::string& name) const {
  const std::vector<double>& found = column(name);
  if (std::count(names.begin(), names.end(), name) > 1)
    throw CsvError(fmt::format("two columns are named {}; name them apart", name));
  const std::string& where = strange[static_cast<std::size_t>(&found - columns.data())];
  if (!where.empty()) throw CsvError(fmt::format("{}; a number, nothing, or nan is needed", where));
  return found;
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
