#include "host_tools/report/column_alignment.hpp"

#include <cctype>

namespace kmax::report {

namespace {
bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Of a row of digits from `at` on.
std::size_t end_of_digits(std::string_view text, std::size_t at) {
  while (at < text.size() && is_digit(text[at])) ++at;
  return at;
}

/// Where the number that the text begins with ends; 0: it begins with none.
std::size_t end_of_number(std::string_view text) {
  std::size_t at = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  const std::size_t whole = end_of_digits(text, at);
  std::size_t digits = whole - at;
  at = whole;
  if (at < text.size() && text[at] == '.') {
    const std::size_t fraction = end_of_digits(text, at + 1);
    digits += fraction - at - 1;
    at = fraction;
  }
  if (digits == 0) return 0;
  if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
    std::size_t exponent = at + 1;
    if (exponent < text.size() && (text[exponent] == '-' || text[exponent] == '+')) ++exponent;
    const std::size_t end = end_of_digits(text, exponent);
    if (end > exponent) at = end;
  }
  return at;
}
}  // namespace

bool reads_as_number(std::string_view text) {
  // "at least" marks of a search that ended at its bound.
  while (!text.empty() && (text[0] == '>' || text[0] == '<' || text[0] == '=' || text[0] == ' '))
    text.remove_prefix(1);
  const std::size_t end = end_of_number(text);
  if (end == 0) return false;
  if (end == text.size()) return true;
  if (text[end] != ' ') return false;
  // The unit has no digit but an exponent ("N/m^2") and no space but those of products ("N s/m").
  const std::string_view unit = text.substr(end + 1);
  // A mean and its spread.
  if (unit.size() > 2 && unit.front() == '(' && unit.back() == ')')
    return reads_as_number(unit.substr(1, unit.size() - 2));
  if (unit.empty() || unit.size() > 8) return false;
  for (const std::string_view word : {"of", "to", "or", "and", "x"}) {
    if (unit.substr(0, unit.find(' ')) == word) return false;
  }
  return !is_digit(unit[0]) && unit[0] != '-' && unit[0] != '+' && unit[0] != '(';
}

std::vector<bool> number_columns(const Table& table) {
  require_rectangular(table);
  std::vector<bool> numbers(table.columns.size(), false);
  for (std::size_t column = 0; column < numbers.size(); ++column) {
    bool any = false, other = false;
    for (const auto& row : table.rows) {
      const std::string& cell = row[column];
      if (cell.empty() || cell == "-" || cell == "NA") continue;
      (reads_as_number(cell) ? any : other) = true;
    }
    numbers[column] = any && !other;
  }
  return numbers;
}

}  // namespace kmax::report
