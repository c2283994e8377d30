#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::base {

/// The double whose shortest text is also the shortest text that reads back as this float32: 2.4f gives
/// 2.4, not 2.4000000953674316. For JSON, whose numbers are doubles.
double shortest_double(float value);

/// Shortest text that reads back as the same number. Plain decimals from 0.0001 up to a million; beyond
/// that a power of ten where it is shorter ("1e6", "-2.5e-7").
std::string number_text(double value);
inline std::string number_text(float value) {
  return number_text(shortest_double(value));
}

/// number x multiply / divide: a factor of a thousandth as a division, so that "1mm" is the double nearest
/// to 0.001.
struct UnitScale {
  double multiply = 1;
  double divide = 1;

  double to_si(double number) const { return number * multiply / divide; }
};

/// How a number written in `suffix` becomes one in the dictionary's `unit`: "N/mm" -> "N/m" is 1000. Spaces
/// and middle dots in a suffix do not matter ("N s/m", "Ns/m"); an empty suffix is the unit itself.
std::optional<UnitScale> scale_from(std::string_view suffix, std::string_view unit);

/// Suffixes that are understood for `unit`, the unit itself first; empty for a number without a unit.
std::vector<std::string> suffixes_of(std::string_view unit);

/// Without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

/// "3580 N/m", or the number alone where there is no unit.
std::string in_unit(std::string text, std::string_view unit);

struct WrittenNumber {
  double value;          ///< in the unit that was asked for
  std::string as_given;  ///< number and unit, for messages
};

/// A number as a person writes it, in `unit` or with one that converts to it: "0.5N/mm", "1 mm", "800".
/// ValueError for anything else, NaN and infinities among it: a clause to stand behind the name of what the
/// number is for. `kind` and `allowed` say in it what belongs there: "a number", "0 .. 1e6 N/m".
WrittenNumber written_number(std::string_view text, std::string_view unit, std::string_view kind,
                             std::string_view allowed);

}  // namespace kmax::base
