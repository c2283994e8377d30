#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace kmax::base {

/// What to say when a file cannot be written.
std::runtime_error cannot_write(const std::string& path);

/// Throws cannot_write() before anybody waits for what is to be written. Leaves what is there.
void check_writable(const std::string& path);

/// Whole or not at all: who reads the file finds the old text or the new one, whatever happens meanwhile. The
/// text goes into a new file beside it, which takes its name when it is on the disk; it keeps the permissions
/// of the one before. What is no regular file (/dev/stdout, a pipe) is written directly. Throws a
/// std::runtime_error that says why; what was there is as it was.
void write_file(const std::filesystem::path& path, std::string_view text);

}  // namespace kmax::base
