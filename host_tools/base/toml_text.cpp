#include "host_tools/base/toml_text.hpp"

#include <fmt/format.h>

#include <optional>

namespace kmax::base {

namespace {
struct Place {
  std::size_t line = 1, column = 1;
};

/// Behind the string, the comment or the one character that begins at `at`.
std::size_t after_token(std::string_view text, std::size_t at) {
  const char first = text[at];
  if (first == '#') return std::min(text.find('\n', at), text.size());
  if (first != '"' && first != '\'') return at + 1;
  const bool long_one = text.substr(at, 3) == std::string(3, first);
  const std::string_view end = text.substr(at, long_one ? 3 : 1);
  for (std::size_t i = at + end.size(); i < text.size(); ++i) {
    if (first == '"' && text[i] == '\\') {
      ++i;
    } else if (text.substr(i, end.size()) == end) {
      std::size_t after = i + end.size();
      // Up to two quotes of a long string's own may stand right before its end.
      for (int own = 0; long_one && own < 2 && after < text.size() && text[after] == first; ++own) ++after;
      return after;
    } else if (text[i] == '\n' && !long_one) {
      return i;  // not closed: the parser's to say
    }
  }
  return text.size();
}

/// Where the nesting gets too deep, found without building anything.
std::optional<Place> too_deep(std::string_view text) {
  Place place;
  std::size_t names = 0, brackets = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t after = after_token(text, at);
    switch (text[at]) {
      case '.':
        ++names;
        break;
      case '[':
      case '{':
        ++brackets;
        names = 0;
        break;
      case ']':
      case '}':
        if (brackets > 0) --brackets;
        break;
      case '\n':
      case ',':
      case '=':
        names = 0;
        break;
      default:
        break;
    }
    if (names >= toml_depth_max || brackets > toml_depth_max) return place;
    for (; at < after; ++at) {
      place = text[at] == '\n' ? Place{place.line + 1, 1} : Place{place.line, place.column + 1};
    }
  }
  return std::nullopt;
}
}  // namespace

toml::table parsed_toml(std::string_view text, std::string_view source, std::string& problem) {
  if (const auto place = too_deep(text)) {
    problem = fmt::format("{}:{}:{}: nested more than {} deep; nothing that is read here is deeper than four",
                          source, place->line, place->column, toml_depth_max);
    return {};
  }
  try {
    return toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    problem = fmt::format("{}:{}:{}: not valid TOML: {}", source, error.source().begin.line,
                          error.source().begin.column, error.description());
    return {};
  }
}

}  // namespace kmax::base
