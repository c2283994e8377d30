#include "host_tools/wall/wall_evaluation.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/files.hpp"

namespace kmax::wall {

WallEvaluator::WallEvaluator(const firmware::ParameterValues& values, std::size_t axis)
    : coefficients_(
          control::WallLaw<double>::prepare(firmware::wall_configuration<double>(values, axis),
                                            1.0 / static_cast<double>(values.real<"haptic.rate">(axis)))),
      position_(static_cast<double>(values.real<"wall.position">(axis))),
      side_(values.whole<"wall.side">(axis)) {}

Evaluation WallEvaluator::at(double position, double velocity) const {
  control::WallLaw<double> law;
  const auto out = law.update(coefficients_, side_ * (position - position_), side_ * velocity);
  // Adding zero turns the minus zero of a mirrored wall into a plain one.
  return {side_ * out.force + 0.0, side_ * out.magnetic_force + 0.0, out.inside};
}

namespace {

constexpr std::string_view position_column = "position_m";
constexpr std::string_view velocity_column = "velocity_m_per_s";
constexpr std::size_t absent = static_cast<std::size_t>(-1);

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

/// Takes the first field off `rest`, which has no value after the last one: a comma at the end of a line
/// is followed by an empty field.
std::string_view next_field(std::optional<std::string_view>& rest) {
  const std::string_view line = *rest;
  const std::size_t comma = line.find(',');
  rest = comma == std::string_view::npos ? std::nullopt : std::optional(line.substr(comma + 1));
  return trimmed(line.substr(0, comma));
}

struct Columns {
  std::size_t position = absent, velocity = absent, count = 0;
};

Columns read_header(std::string_view line, const std::string& file) {
  Columns columns;
  std::optional<std::string_view> fields = line;
  while (fields) {
    const std::string_view name = next_field(fields);
    for (const auto& [wanted, place] :
         {std::pair(position_column, &columns.position), std::pair(velocity_column, &columns.velocity)}) {
      if (name != wanted) continue;
      if (*place != absent) throw TableError(fmt::format("{}:1: two columns are named {}", file, wanted));
      *place = columns.count;
    }
    ++columns.count;
  }
  if (columns.position == absent)
    throw TableError(
        fmt::format("{}:1: the first line must name the columns, {} and if wanted {}; it reads '{}'", file,
                    position_column, velocity_column, trimmed(line)));
  return columns;
}

double read_number(std::string_view field, std::string_view column, const std::string& file,
                   std::size_t line) {
  double value = 0;
  const bool plus = field.starts_with('+') && !field.starts_with("+-");
  const std::string_view digits = plus ? field.substr(1) : field;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || !control::is_finite(value))
    throw TableError(fmt::format("{}:{}: {} is '{}'; a finite number is needed", file, line, column, field));
  return value;
}

}  // namespace

EvaluatedTable evaluated_table(const WallEvaluator& evaluator, const std::filesystem::path& input) {
  const std::string text = base::text_of<TableError>(
      input, "give the path of a table with the columns position_m,velocity_m_per_s");
  const std::string file = input.string();
  std::string_view rest = text;
  std::size_t line_number = 0, rows = 0;
  Columns columns;
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "{},{},force_n\n", position_column, velocity_column);

  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    ++line_number;
    if (trimmed(line).empty() || line.front() == '#') continue;
    if (columns.count == 0) {
      columns = read_header(line, file);
      continue;
    }
    double position = 0, velocity = 0;
    std::size_t column = 0;
    std::optional<std::string_view> fields = line;
    while (fields) {
      const std::string_view field = next_field(fields);
      if (column == columns.position) position = read_number(field, position_column, file, line_number);
      if (column == columns.velocity) velocity = read_number(field, velocity_column, file, line_number);
      ++column;
    }
    if (column != columns.count)
      throw TableError(fmt::format("{}:{}: {} fields where the first line names {} columns", file,
                                   line_number, column, columns.count));
    fmt::format_to(std::back_inserter(out), "{},{},{}\n", position, velocity,
                   evaluator.at(position, velocity).force);
    ++rows;
  }
  if (columns.count == 0) throw TableError(fmt::format("{}: the file is empty", file));
  return {fmt::to_string(out), rows};
}

std::size_t evaluate_table(const WallEvaluator& evaluator, const std::filesystem::path& input,
                           const std::filesystem::path& output) {
  const EvaluatedTable table = evaluated_table(evaluator, input);
  std::error_code error;
  // The finished table takes the place of what has its name: that must not be /dev/stdout, or a folder.
  if (std::filesystem::exists(output, error) && !std::filesystem::is_regular_file(output, error))
    throw TableError(
        fmt::format("{}: is not a regular file; give the name of a file to write", output.string()));
  try {
    base::write_file(output, table.text);
  } catch (const std::runtime_error& failure) {
    throw TableError(failure.what());
  }
  return table.rows;
}

}  // namespace kmax::wall
