#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>

namespace kmax::base {

/// How many names a TOML key may have, and how many arrays and inline tables may lie in each other. Our files
/// have three; the parser calls itself for each and overflows the stack at some ten thousand.
inline constexpr std::size_t toml_depth_max = 32;

/// `text` as TOML. When it is not, or is nested deeper than toml_depth_max, `problem` says what is wrong and
/// where, as "SOURCE:LINE:COLUMN: ...", and the table is empty.
toml::table parsed_toml(std::string_view text, std::string_view source, std::string& problem);

/// The same; a problem is thrown as an Error.
template <typename Error>
toml::table parsed_toml(std::string_view text, std::string_view source) {
  std::string problem;
  toml::table table = parsed_toml(text, source, problem);
  if (!problem.empty()) throw Error(problem);
  return table;
}

}  // namespace kmax::base
