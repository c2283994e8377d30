#pragma once

#include <filesystem>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

namespace kmax::base {

/// What to say when a file cannot be written.
std::runtime_error cannot_write(const std::string& path);

/// Throws cannot_write() before anybody waits for what is to be written. Leaves what is there, and opens no
/// pipe: its reader would take the closing for the end.
void check_writable(const std::string& path);

/// A folder to write into, with those above it, if it is not there yet. Throws a std::runtime_error that says
/// what stands in its way.
void make_folder(const std::filesystem::path& path);

/// A file that a command line names, and by which option.
struct NamedFile {
  std::string_view option;
  std::string path;  ///< empty or "-": none
};
/// Throws ValueError if two of them are one file, by whatever names or links.
void require_different_files(std::initializer_list<NamedFile> files);

/// Whole or not at all: who reads the file finds the old text or the new one, whatever happens meanwhile. The
/// text goes into a new file beside it, which takes its name when it is on the disk; it keeps the permissions
/// of the one before. What is no regular file (/dev/stdout, a pipe) is written directly. Throws a
/// std::runtime_error that says why; what was there is as it was.
void write_file(const std::filesystem::path& path, std::string_view text);

// Files that come from outside: written by a person, or cut off, or not what they are taken for.

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
