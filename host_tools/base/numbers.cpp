#include "host_tools/base/numbers.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace kmax::device {

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

}  // namespace kmax::device
