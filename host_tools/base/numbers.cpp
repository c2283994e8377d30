#include "host_tools/base/numbers.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "host_tools/base/errors.hpp"

namespace kmax::base {

namespace {
using Buffer = std::array<char, 400>;  // the longest plain double has 309 digits before the point

std::string_view written(const Buffer& buffer, const std::to_chars_result& result) {
  return {buffer.data(), static_cast<std::size_t>(result.ptr - buffer.data())};
}

/// "1e+06" -> "1e6", "2.5e-07" -> "2.5e-7".
std::string without_padding(std::string_view scientific) {
  const auto e = scientific.find('e');
  std::string text(scientific.substr(0, e + 1));
  std::string_view exponent = scientific.substr(e + 1);
  if (exponent.front() == '-') text += '-';
  exponent.remove_prefix(1);
  exponent.remove_prefix(std::min(exponent.find_first_not_of('0'), exponent.size() - 1));
  return text.append(exponent);
}
}  // namespace

double shortest_double(float value) {
  if (!std::isfinite(value)) return static_cast<double>(value);
  Buffer buffer;
  const auto text = written(buffer, std::to_chars(buffer.data(), buffer.data() + buffer.size(), value));
  double number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

std::string number_text(double value) {
  Buffer buffer;
  const double magnitude = std::fabs(value);
  if (!std::isfinite(value) || value == 0.0 || (magnitude >= 1e-4 && magnitude < 1e6)) {
    if (value == 0.0) return "0";
    const auto format = std::isfinite(value) ? std::chars_format::fixed : std::chars_format::general;
    return std::string(
        written(buffer, std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format)));
  }
  const std::string power =
      without_padding(written(buffer, std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                                    std::chars_format::scientific)));
  const std::string_view plain = written(
      buffer, std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed));
  return power.size() < plain.size() ? power : std::string(plain);
}

namespace {
struct Conversion {
  std::string_view unit;    ///< as the dictionary writes it
  std::string_view suffix;  ///< as users write it
  UnitScale scale;
};

constexpr UnitScale times(double factor) {
  return {factor, 1};
}
constexpr UnitScale over(double factor) {
  return {1, factor};
}

// Case matters: mN is not MN.
constexpr Conversion conversions[] = {
    {"m", "mm", over(1e3)},          {"m", "um", over(1e6)},          {"m", "µm", over(1e6)},
    {"m", "cm", over(1e2)},          {"m/s", "mm/s", over(1e3)},      {"m/s", "cm/s", over(1e2)},
    {"m/rad", "mm/rad", over(1e3)},  {"N", "mN", over(1e3)},          {"N", "kN", times(1e3)},
    {"N/m", "N/mm", times(1e3)},     {"N/m", "kN/m", times(1e3)},     {"N/m", "N/cm", times(1e2)},
    {"N s/m", "N s/mm", times(1e3)}, {"N s/m", "mN s/mm", times(1)},  {"N/s", "kN/s", times(1e3)},
    {"N/s", "N/ms", times(1e3)},     {"N m/A", "mN m/A", over(1e3)},  {"s", "ms", over(1e3)},
    {"s", "us", over(1e6)},          {"s", "min", times(60)},         {"Hz", "kHz", times(1e3)},
    {"kg", "g", over(1e3)},          {"ohm", "mohm", over(1e3)},      {"ohm", "Ohm", times(1)},
    {"H", "mH", over(1e3)},          {"H", "uH", over(1e6)},          {"A", "mA", over(1e3)},
    {"V", "mV", over(1e3)},          {"degC", "C", times(1)},         {"degC", "°C", times(1)},
    {"bit/s", "kbit/s", times(1e3)}, {"bit/s", "Mbit/s", times(1e6)}, {"rad/s", "krad/s", times(1e3)},
    {"F", "mF", over(1e3)},          {"F", "uF", over(1e6)},          {"N m", "mN m", over(1e3)},
    {"V", "uV", over(1e6)},          {"s", "ns", over(1e9)},          {"kg", "mg", over(1e6)},
};

/// The micro sign, as the table has it, and the Greek letter look the same.
constexpr std::string_view micro_sign = "µ", greek_mu = "μ";

std::string without_spacing(std::string_view text) {
  std::string bare;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i).starts_with("·")) {
      i += std::string_view("·").size() - 1;
    } else if (text.substr(i).starts_with(greek_mu)) {
      bare += micro_sign;
      i += greek_mu.size() - 1;
    } else if (text[i] != ' ' && text[i] != '*') {
      bare += text[i];
    }
  }
  return bare;
}
}  // namespace

std::optional<UnitScale> scale_from(std::string_view suffix, std::string_view unit) {
  const std::string bare = without_spacing(suffix);
  if (bare.empty() || bare == without_spacing(unit)) return UnitScale{};
  for (const Conversion& conversion : conversions) {
    if (conversion.unit == unit && without_spacing(conversion.suffix) == bare) return conversion.scale;
  }
  return std::nullopt;
}

std::vector<std::string> suffixes_of(std::string_view unit) {
  if (unit.empty()) return {};
  std::vector<std::string> suffixes{std::string(unit)};
  for (const Conversion& conversion : conversions) {
    if (conversion.unit == unit) suffixes.emplace_back(conversion.suffix);
  }
  return suffixes;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string in_unit(std::string text, std::string_view unit) {
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

WrittenNumber written_number(std::string_view given, std::string_view unit, std::string_view kind,
                             std::string_view allowed) {
  const std::string_view text = trimmed(given);
  std::string_view rest = text;
  if (rest.starts_with('+')) rest.remove_prefix(1);
  // Keeps out what from_chars() would take as well: inf, nan.
  const std::string_view digits =
      rest.starts_with('-') && rest.size() != text.size() ? "" : rest.substr(rest.starts_with('-'));
  const bool starts_like_a_number = digits.find_first_of("0123456789") == (digits.starts_with('.') ? 1u : 0u);
  if (!starts_like_a_number) throw ValueError(fmt::format("'{}' is not {}", text, kind));

  double number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc{})
    throw ValueError(fmt::format("{} is not a number this program can hold; allowed is {}", text, allowed));
  const std::string_view suffix = trimmed(rest.substr(static_cast<std::size_t>(end - rest.data())));
  const auto scale = scale_from(suffix, unit);
  if (!scale) {
    if (unit.empty())
      throw ValueError(fmt::format("'{}': it has no unit, so nothing may follow the number", text));
    throw ValueError(fmt::format("'{}': '{}' is not one of its units {}; without a unit the number is in {}",
                                 text, suffix, fmt::join(suffixes_of(unit), ", "), unit));
  }
  const std::string_view bare = trimmed(text.substr(0, text.size() - suffix.size()));
  return {scale->to_si(number), in_unit(std::string(bare), suffix.empty() ? unit : suffix)};
}

}  // namespace kmax::base
