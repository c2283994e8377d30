#pragma once

#include <filesystem>
#include <string>
#include <string_view>

// Files that come from outside: written by a person, or cut off, or not what they are taken for.

namespace kmax::base {

/// No file that these tools read as text is near this size, bytes; a device such as /dev/zero never ends.
inline constexpr std::size_t text_file_max = std::size_t{256} << 20;

/// The whole text of a file, a pipe or /dev/stdin. When it cannot be read, or is larger than text_file_max,
/// `problem` says so in a sentence that begins with the path and ends with `advice`, and the text is empty.
std::string text_of(const std::filesystem::path& file, std::string_view advice, std::string& problem);

/// The same; a problem is thrown as an Error.
template <typename Error>
std::string text_of(const std::filesystem::path& file, std::string_view advice) {
  std::string problem;
  std::string text = text_of(file, advice, problem);
  if (!problem.empty()) throw Error(problem);
  return text;
}

}  // namespace kmax::base
