#include "host_tools/base/input_file.hpp"

#include <fmt/format.h>

#include <fstream>

namespace kmax::base {

std::string text_of(const std::filesystem::path& file, std::string_view advice, std::string& problem) {
  const auto fail = [&](std::string_view what) {
    problem = fmt::format("{}: {}; {}", file.string(), what, advice);
    return std::string();
  };
  std::error_code ignored;
  // A folder can be opened; only reading it fails.
  if (std::filesystem::is_directory(file, ignored)) return fail("cannot be read: it is a folder");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fail("cannot be read");
  std::string text;
  std::string piece(1 << 16, '\0');
  while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())) || stream.gcount() > 0) {
    text.append(piece, 0, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > text_file_max)
      return fail(fmt::format("is larger than {} MiB and so not such a file", text_file_max >> 20));
  }
  return stream.bad() ? fail("reading it failed") : text;
}

}  // namespace kmax::base
